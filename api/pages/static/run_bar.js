// The run bar: on every page while a session runs. The button stays the same element for as long as it is shown, so that
// a press is never lost to a redraw; it acts on the press, not on the release, and by the key Esc from anywhere.

const POLL_EVERY = 1000; // ms
const csrf = () => document.querySelector('meta[name="csrf-token"]').content;

const meta = (name) => document.querySelector(`meta[name="${name}"]`)?.content;
const POST = { method: "POST", credentials: "include", keepalive: true };

// Both ways at once, for a stop is harmless when repeated: to the service, and to the stop's own port, where there is one,
// which answers whatever the service is doing. The first that stopped counts.
function askToStop() {
  const ways = [fetch("/pages/stop", { ...POST, headers: { "X-CSRF-Token": csrf() }, signal: AbortSignal.timeout(3000) })];
  const port = meta("stop-port");
  if (port)
    ways.push(fetch(`https://${location.hostname}:${port}/pages/stop`, { ...POST, signal: AbortSignal.timeout(3000) }));
  const answered = ways.map(async (way) => {
    const response = await way;
    if (!response.ok) throw new Error(`status ${response.status}`);
    return (await response.json()).words;
  });
  return Promise.any(answered);
}

async function pressStop(bar) {
  const button = bar.querySelector("[data-stop]");
  const note = bar.querySelector("[data-run-note]");
  button.dataset.state = "sent";
  note.textContent = "Stop sent. Waiting for the drives to answer.";
  for (let attempt = 1; ; attempt += 1) {
    try {
      note.textContent = await askToStop();
      return;
    } catch (refusals) {
      const refused = refusals.errors.find((each) => each.message.startsWith("status"));
      note.textContent = refused
        ? `The service did not stop the motion (${refused.message}). Use the emergency stop of the machine.`
        : `No answer (attempt ${attempt}). Use the emergency stop of the machine. Trying again.`;
      await new Promise((resume) => setTimeout(resume, 300));
      if (attempt < 20) continue;
    }
    button.dataset.state = "";
    return;
  }
}

function show(bar, run) {
  bar.hidden = !run.running;
  document.documentElement.dataset.running = run.running ? "yes" : "";
  const button = bar.querySelector("[data-stop]");
  if (!run.running) {
    button.dataset.state = "";
    return;
  }
  bar.querySelector("[data-run-title]").textContent = run.title;
  bar.querySelector("[data-run-detail]").textContent = run.detail;
  bar.querySelector("[data-run-left]").textContent = run.left;
  bar.querySelector("[data-run-progress]").value = run.fraction ?? 0;
  if (button.dataset.state !== "sent") bar.querySelector("[data-run-note]").textContent = run.note;
}

// What a person must do at once stands on top of every page, in red, until the rig was checked again.
function sayAlarms(alarms) {
  const place = document.querySelector("[data-alarm]");
  if (!place) return;
  const words = alarms.join("\n");
  if (place.textContent !== words) place.textContent = words;
  place.hidden = !words;
}

function sayConnection(state, words) {
  const place = document.querySelector("[data-connection]");
  if (!place) return;
  place.className = `state ${state}`;
  if (place.textContent !== words) place.textContent = words; // read aloud where it changes
}

export function watchTheRun() {
  const bar = document.querySelector("[data-run-bar]");
  if (!bar) return;
  bar.querySelector("[data-stop]").addEventListener("pointerdown", () => pressStop(bar));
  bar.querySelector("[data-stop]").addEventListener("click", (event) => {
    if (event.detail === 0) pressStop(bar); // a click without a pointer: from the keyboard
  });
  document.addEventListener(
    "keydown",
    (event) => {
      if (event.key === "Escape" && !bar.hidden) {
        event.preventDefault();
        event.stopImmediatePropagation();
        pressStop(bar);
      }
    },
    { capture: true },
  );

  let lost = false;
  let told = null; // what the live page hears of its rig, sooner than it can be asked for
  let known = null; // what was said of the rigs last
  let timer = 0;
  let leaving = false;
  function sayState() {
    const ours = told && (known?.rig ?? told.rig) === told.rig;
    if (ours) sayConnection(told.kind === "idle" || !told.moves ? "good" : told.kind, told.short);
    else if (known) sayConnection(known.rig_state, known.rig_words);
  }
  document.addEventListener("rig-told", ({ detail }) => {
    told = detail;
    if (told) sayState();
  });
  // What a person does shows in the bar at once.
  document.addEventListener("session-moved", () => poll());
  document.addEventListener("htmx:afterRequest", ({ detail }) => {
    // A page that is told to go elsewhere asks no more: signed out, it would be sent to the sign-in a second time.
    leaving ||= Boolean(detail.xhr?.getResponseHeader("HX-Redirect"));
    if (detail.requestConfig.verb !== "get") poll();
  });
  function again() {
    clearTimeout(timer); // one that was asked for in between has its turn already
    timer = setTimeout(poll, POLL_EVERY);
  }
  async function poll() {
    clearTimeout(timer);
    if (leaving) return;
    try {
      const response = await fetch("/pages/run-state", { signal: AbortSignal.timeout(4000) });
      if (leaving) return;
      if (response.status === 401) {
        if (bar.hidden) {
          location.assign(`/pages/sign-in?then=${encodeURIComponent(location.pathname)}&ended=true`);
          return;
        }
        // Who was let in may still stop: the button stays as long as something may move.
        bar.querySelector("[data-run-note]").textContent =
          "Your sign-in has ended. STOP still works; sign in again in another window to see how the motion goes.";
        again();
        return;
      }
      const run = await response.json();
      show(bar, run);
      document.dispatchEvent(new CustomEvent("run-shown"));
      sayAlarms(run.alarms);
      bar.classList.remove("lost");
      const changed = known !== null && known.rig_words !== run.rig_words;
      known = run;
      sayState();
      // Pages that show a session's steps or what became of it look again.
      if (changed && !told) document.dispatchEvent(new CustomEvent("session-moved"));
      const others = document.querySelector("[data-onlookers]");
      if (others) others.textContent = run.onlookers;
      if (lost) document.dispatchEvent(new CustomEvent("connection-back"));
      lost = false;
      document.dispatchEvent(new CustomEvent("run-state", { detail: run }));
    } catch {
      lost = true;
      bar.classList.add("lost");
      sayConnection("warn", "No connection");
      document.dispatchEvent(new CustomEvent("connection-lost"));
      if (!bar.hidden)
        bar.querySelector("[data-run-note]").textContent =
          "The connection is lost; the motion goes on. If it must stop now, use the emergency stop of the machine.";
    }
    again();
  }
  poll();
}
