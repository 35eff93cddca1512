// What is missing, from the keyboard: choose with the arrows, add, undo, redo.

const typing = (target) => target.closest("input, select, textarea, [contenteditable]");

function candidates() {
  return [...document.querySelectorAll("[data-candidate]")];
}

function choose(step) {
  const items = candidates();
  if (!items.length) return;
  const now = items.findIndex((item) => item.classList.contains("selected"));
  const next = Math.min(Math.max(now + step, 0), items.length - 1);
  if (next !== now) items[next].querySelector("[data-select]").click();
}

function press(selector) {
  const button = document.querySelector(selector);
  if (button && !button.disabled) button.click();
  return Boolean(button);
}

document.addEventListener("click", (event) => {
  const link = event.target.closest("[data-select]");
  if (!link) return;
  for (const item of candidates()) item.classList.toggle("selected", item.contains(link));
});

// A key that is pressed while a step is being taken waits for its end: it means what stands on the page then. What the
// page asks for by itself (progress, news) takes no key away.
let taken = 0;
let waiting = null;
const changes = (event) => event.detail.requestConfig.verb !== "get";
document.addEventListener("htmx:beforeRequest", (event) => {
  if (changes(event)) taken += 1;
});
document.addEventListener("htmx:afterRequest", (event) => {
  if (!changes(event)) return;
  taken = Math.max(0, taken - 1);
  const key = waiting;
  waiting = null;
  if (key && !taken) act(key);
});
// An answer that was asked for before the step says what stood then: the step's own answer counts. Events of an element
// that has left the page are heard at the element only.
document.addEventListener("htmx:beforeSwap", ({ detail }) => {
  if (!detail.target?.matches("[data-steps]")) return;
  for (const asking of detail.target.querySelectorAll(".htmx-request"))
    if (asking !== detail.requestConfig.elt) asking.addEventListener("htmx:beforeOnLoad", (event) => event.preventDefault());
});
document.addEventListener("htmx:beforeOnLoad", (event) => {
  const { xhr, requestConfig } = event.detail;
  if (taken && requestConfig.verb === "get" && xhr.getResponseHeader("HX-Refresh")) event.preventDefault();
});

function act(key) {
  if (key === "arrowdown" || key === "j") choose(1);
  else if (key === "arrowup" || key === "k") choose(-1);
  else if (key === "enter") press(".candidate.selected button");
  else press(`[data-key="${key}"]`);
}

const KEYS = ["arrowdown", "arrowup", "j", "k", "enter", "a", "u", "r"];
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || typing(event.target)) return;
  if (localStorage.getItem("single-keys") === "off") return;
  const key = event.key.toLowerCase();
  if (!KEYS.includes(key) || (key === "enter" && event.target.closest("button, a"))) return;
  event.preventDefault();
  if (!taken) act(key);
  else if (!event.repeat) waiting = key;
});
