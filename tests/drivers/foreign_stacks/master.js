// A CANopen master on node-canopen: brings one drive up, moves it, waits for its emergency, says what it saw.
//
// Frames travel as lines "ID HEX" on stdin and stdout; "ask WORDS" asks the test for something, "result JSON" ends.
const Module = require("module");
const readline = require("readline");

// node-canopen takes its CRC of SDO block transfer from a compiled package; CRC-16-CCITT as CiA 301, 7.2.4.3.16 states it
const load = Module._load;
Module._load = (request, ...rest) => (request === "node-crc" ? { crc: crc16 } : load(request, ...rest));

function crc16(_width, _reflect, polynomial, _start, _xor, _a, _b, _c, data) {
  let value = 0;
  for (const byte of data) {
    value ^= byte << 8;
    for (let bit = 0; bit < 8; bit += 1) value = value & 0x8000 ? (value << 1) ^ polynomial : value << 1;
  }
  const found = Buffer.alloc(2);
  found.writeUInt16BE(value & 0xffff);
  return found;
}

const { Device, DataType } = require("canopen");

const NODE = Number(process.argv[2]);
const CYCLES = 60;
const device = new Device({ id: 0x7e });
const seen = { heartbeats: [], positions: [], emergencies: [], aborts: [] };
const waiting = [];
let onTpdo = () => {};

function until(what, condition) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`${what} did not come`)), 8000);
    waiting.push({ condition, resolve: () => (clearTimeout(timer), resolve()) });
    look();
  });
}

function look() {
  for (const each of waiting.splice(0)) {
    if (each.condition()) each.resolve();
    else waiting.push(each);
  }
}

const read = (index, subIndex, dataType) =>
  device.sdo.upload({ serverId: NODE, index, subIndex, dataType, timeout: 3000 });
const write = (index, subIndex, data, dataType) =>
  device.sdo.download({ serverId: NODE, index, subIndex, data, dataType, timeout: 3000 });

async function refused(action) {
  try {
    await action();
    seen.aborts.push(null);
  } catch (error) {
    seen.aborts.push(error.code);
  }
}

async function statusword(mask, pattern) {
  for (let attempt = 0; attempt < 100; attempt += 1) {
    const word = await read(0x6041, 0, DataType.UNSIGNED16);
    if ((word & mask) === pattern) return;
    device.sync.write(); // a drive that brakes does so from SYNC to SYNC
  }
  throw new Error(`the statusword does not become ${pattern.toString(16)}`);
}

async function main() {
  const { UNSIGNED8, UNSIGNED16, UNSIGNED32, INTEGER8, INTEGER32, VISIBLE_STRING } = DataType;
  device.eds.addSdoClientParameter(NODE, 0x600 + NODE, 0x580 + NODE);
  device.eds.addHeartbeatConsumer(NODE, 2000);
  device.eds.addEmcyConsumer(0x80 + NODE);
  device.eds.setSyncCobId(0x80);
  device.eds.setSyncGenerationEnable(true);
  const status = device.eds.addEntry(0x2000, { parameterName: "status", dataType: UNSIGNED16 });
  const position = device.eds.addEntry(0x2001, { parameterName: "position", dataType: INTEGER32 });
  const control = device.eds.addEntry(0x2002, { parameterName: "control", dataType: UNSIGNED16 });
  const target = device.eds.addEntry(0x2003, { parameterName: "target", dataType: INTEGER32 });
  device.eds.addReceivePdo({ cobId: 0x180 + NODE, transmissionType: 255, dataObjects: [status, position] });
  device.eds.addTransmitPdo({ cobId: 0x200 + NODE, transmissionType: 255, dataObjects: [control, target] });
  device.nmt.on("heartbeat", ({ state }) => (seen.heartbeats.push(state), look()));
  device.emcy.on("emergency", ({ em }) => (seen.emergencies.push([em.code, em.register]), look()));
  onTpdo = () => (seen.positions.push(position.value), look()); // its own event keeps silent where nothing changed
  device.start();
  device.nmt.startNode(); // itself

  seen.deviceType = await read(0x1000, 0, UNSIGNED32);
  seen.product = await read(0x1018, 2, UNSIGNED32);
  seen.name = await read(0x1008, 0, VISIBLE_STRING);
  await refused(() => read(0x5fff, 0, UNSIGNED8));
  await refused(() => write(0x6064, 0, 1, INTEGER32));

  await write(0x1017, 0, 50, UNSIGNED16);
  await until("the heartbeat", () => seen.heartbeats.includes(127));
  for (const [communication, mapping, entries, kind] of [
    [0x1800, 0x1a00, [0x60410010, 0x60640020], 1],
    [0x1400, 0x1600, [0x60400010, 0x607a0020], 1],
  ]) {
    const id = (communication === 0x1800 ? 0x180 : 0x200) + NODE;
    await write(communication, 1, (0x80000000 | id) >>> 0, UNSIGNED32);
    await write(communication, 2, kind, UNSIGNED8);
    await write(mapping, 0, 0, UNSIGNED8);
    for (const [place, entry] of entries.entries()) await write(mapping, place + 1, entry, UNSIGNED32);
    await write(mapping, 0, entries.length, UNSIGNED8);
    await write(communication, 1, id, UNSIGNED32);
  }
  await write(0x1006, 0, 2000, UNSIGNED32);
  await write(0x60c2, 1, 2, UNSIGNED8);
  device.nmt.startNode(NODE);
  await until("OPERATIONAL", () => seen.heartbeats.includes(5));

  await write(0x6060, 0, 8, INTEGER8);
  seen.start = await read(0x6064, 0, INTEGER32);
  target.value = seen.start;
  for (const [word, mask, pattern] of [[0x06, 0x6f, 0x21], [0x07, 0x6f, 0x23], [0x0f, 0x6f, 0x27]]) {
    await write(0x6040, 0, word, UNSIGNED16);
    await statusword(mask, pattern);
  }
  control.value = 0x0f;
  for (let cycle = 1; cycle <= CYCLES; cycle += 1) {
    target.value = seen.start + 5 * Math.min(cycle, CYCLES / 2);
    device.pdo.write(0x200 + NODE);
    const before = seen.positions.length;
    device.sync.write();
    await until(`TPDO ${cycle}`, () => seen.positions.length > before);
  }
  console.log("ask fail");
  device.sync.write();
  await until("the emergency", () => seen.emergencies.length > 0);
  await statusword(0x4f, 0x08);
  await write(0x6040, 0, 0x00, UNSIGNED16);
  await write(0x6040, 0, 0x80, UNSIGNED16);
  await statusword(0x4f, 0x40);
  device.nmt.stopNode(NODE);
  await until("STOPPED", () => seen.heartbeats.includes(4));
  device.stop();
}

device.on("message", ({ id, data }) => console.log(`${id} ${data ? data.toString("hex") : ""}`));
readline.createInterface({ input: process.stdin }).on("line", (line) => {
  const [id, hex] = line.split(" ");
  const data = Buffer.from(hex || "", "hex");
  device.receive({ id: Number(id), data, len: data.length });
  if (Number(id) === 0x180 + NODE) onTpdo();
});
main().then(
  () => (console.log(`result ${JSON.stringify(seen)}`), process.exit(0)),
  (error) => (console.log(`result ${JSON.stringify({ ...seen, error: String(error.stack) })}`), process.exit(1)),
);
