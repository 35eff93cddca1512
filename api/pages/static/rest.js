// The REST calls: find one, and send it as the one who is signed in. A call that changes something carries the token that the
// guard asks for.

const LONGEST = 200_000; // characters of an answer that are shown; all of it can be kept as a file

function request(call) {
  const { method, path } = call.dataset;
  const headers = { Accept: "application/json", "X-CSRF-Token": document.querySelector('meta[name="csrf-token"]').content };
  const query = new URLSearchParams();
  const form = new FormData();
  let [address, body] = [path, undefined];
  for (const input of call.querySelectorAll("[data-place]")) {
    const { place } = input.dataset;
    if (place === "path") address = address.replace(`{${input.name}}`, encodeURIComponent(input.value));
    else if (place === "query" && input.value) query.set(input.name, input.value);
    else if (place === "form" && input.files) for (const file of input.files) form.append(input.name, file);
    else if (place === "form" && input.value) form.append(input.name, input.value);
    else if (place === "body") [body, headers["Content-Type"]] = [input.value, "application/json"];
  }
  if ([...form.keys()].length) body = form;
  return [query.size ? `${address}?${query}` : address, { method, headers, body }];
}

async function send(call) {
  const place = call.querySelector("[data-answer]");
  const [said, text, file] = ["status", "text", "file"].map((name) => place.querySelector(`[data-${name}]`));
  place.hidden = false;
  said.textContent = "Sent; waiting for the answer.";
  text.textContent = "";
  file.hidden = true;
  try {
    const response = await fetch(...request(call));
    const answer = await response.blob();
    const kind = response.headers.get("content-type") ?? "";
    said.textContent = `${response.status} ${response.statusText}`;
    if (/json$|json;/.test(kind)) text.textContent = JSON.stringify(JSON.parse(await answer.text()), null, 2).slice(0, LONGEST);
    else text.textContent = answer.size ? `${answer.size} bytes, ${kind}` : "No content.";
    if (!answer.size) return;
    file.href = URL.createObjectURL(answer);
    file.download = call.dataset.path.split("/").at(-1).replace(/[{}]/g, "");
    file.hidden = false;
  } catch (error) {
    said.textContent = `The service did not answer (${error.message}). Try again when the connection is back.`;
  }
}

for (const call of document.querySelectorAll("[data-call]"))
  call.querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    send(call);
  });

const find = document.querySelector("[data-find]");
find.addEventListener("input", () => {
  const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
  let found = 0;
  for (const call of document.querySelectorAll("[data-call]")) {
    const text = call.querySelector("summary").textContent.toLowerCase();
    call.hidden = !words.every((word) => text.includes(word));
    found += call.hidden ? 0 : 1;
  }
  for (const subject of document.querySelectorAll("[data-subject]")) subject.hidden = !subject.querySelector("[data-call]:not([hidden])");
  document.querySelector("[data-found]").textContent = words.length ? `${found} calls found` : "";
});

// An address that names a call or a document opens it.
function openNamed() {
  const named = location.hash ? document.getElementById(decodeURIComponent(location.hash.slice(1))) : null;
  if (named?.matches("details")) named.open = true;
}
addEventListener("hashchange", openNamed);
openNamed();
