// The run bar: on every page while a session runs. The button stays the same element for as long as it is shown, so that
// a press is never lost to a redraw; it acts on the press, not on the release, and by the key Esc from anywhere.

const POLL_EVERY = 1000; // ms
const csrf = () => document.querySelector('meta[name="csrf-token"]').content;

async function pressStop(bar) {
  const button = bar.querySelector("[data-stop]");
  const note = bar.querySelector("[data-run-note]");
  button.dataset.state = "sent";
  note.textContent = "Stop sent. Waiting for the drives to answer.";
  for (let attempt = 1; ; attempt += 1) {
    try {
      const response = await fetch("/pages/stop", {
        method: "POST",
        headers: { "X-CSRF-Token": csrf() },
        keepalive: true,
        signal: AbortSignal.timeout(3000),
      });
      if (response.ok) {
        note.textContent = (await response.json()).words;
        return;
      }
      note.textContent = `The service did not stop the motion (status ${response.status}). Use the emergency stop of the machine.`;
    } catch {
      note.textContent = `No answer (attempt ${attempt}). Use the emergency stop of the machine. Trying again.`;
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

function sayConnection(state, words) {
  const place = document.querySelector("[data-connection]");
  if (!place) return;
  place.className = `state ${state}`;
  place.textContent = words;
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
  async function poll() {
    try {
      const response = await fetch("/pages/run-state", { signal: AbortSignal.timeout(4000) });
      if (response.status === 401) {
        location.assign("/pages/sign-in");
        return;
      }
      const run = await response.json();
      show(bar, run);
      bar.classList.remove("lost");
      sayConnection(run.rig_state, run.rig_words);
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
    setTimeout(poll, POLL_EVERY);
  }
  poll();
}
