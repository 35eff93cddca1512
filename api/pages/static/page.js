// What every page has: the theme button, the forms that send themselves, and the run bar with the stop button.
import { watchTheRun } from "./run_bar.js";

const themes = ["auto", "light", "dark"];

function toggleTheme(button) {
  const root = document.documentElement;
  const now = root.dataset.theme ?? "auto";
  const next = themes[(themes.indexOf(now) + 1) % themes.length];
  if (next === "auto") delete root.dataset.theme;
  else root.dataset.theme = next;
  document.cookie = `theme=${next}; path=/; max-age=31536000; samesite=lax`;
  button.textContent = next[0].toUpperCase() + next.slice(1);
  document.dispatchEvent(new CustomEvent("theme-changed"));
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-theme-toggle]");
  if (button) toggleTheme(button);
});

document.addEventListener("change", (event) => {
  if (event.target.matches("[data-submit]")) event.target.form.requestSubmit();
});

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
  document.dispatchEvent(new CustomEvent("theme-changed")),
);

// The guard asks for the token with everything that changes something.
document.addEventListener("htmx:configRequest", (event) => {
  event.detail.headers.Accept = "text/html";
  event.detail.headers["X-CSRF-Token"] = document.querySelector('meta[name="csrf-token"]').content;
});

// What went wrong is said in one place; the next thing that goes right clears it.
document.addEventListener("htmx:beforeRequest", () => document.querySelector("#problem")?.replaceChildren());
function say(words) {
  const place = document.querySelector("#problem");
  if (!place) return;
  const message = document.createElement("div");
  message.className = "message warn";
  message.textContent = words;
  place.replaceChildren(message);
}
document.addEventListener("htmx:sendError", () =>
  say("The service does not answer. Nothing was changed; try again when the connection is back."),
);
// A problem document (RFC 9457) is not markup: its sentence is shown, and what stands on the page stays.
document.addEventListener("htmx:beforeSwap", (event) => {
  const { xhr } = event.detail;
  if (xhr.status < 400 || (xhr.getResponseHeader("content-type") ?? "").startsWith("text/html")) return;
  event.detail.shouldSwap = false;
  try {
    say(JSON.parse(xhr.responseText).detail);
  } catch {
    say(`The service refused this (status ${xhr.status}).`);
  }
});

// Uploads: what is too large is said before it travels, and how far a long one is.
document.addEventListener("htmx:beforeRequest", (event) => {
  const form = event.target.closest?.("[data-upload]");
  const file = form?.querySelector('input[type="file"]').files[0];
  if (!file || file.size <= Number(form.dataset.limit)) return;
  event.preventDefault();
  const megabytes = (size) => Math.round(size / 1048576);
  say(`${file.name} has ${megabytes(file.size)} MiB; this service takes ${megabytes(form.dataset.limit)} MiB at most.`);
});
document.addEventListener("htmx:xhr:progress", (event) => {
  const bar = event.target.closest?.("[data-upload]")?.querySelector("[data-upload-progress]");
  if (!bar || !event.detail.lengthComputable) return;
  bar.hidden = false;
  // Once everything has travelled the file is read and checked: a bar without a value says that this takes a while.
  if (event.detail.loaded < event.detail.total) bar.value = event.detail.loaded / event.detail.total;
  else bar.removeAttribute("value");
});
document.addEventListener("htmx:afterRequest", (event) => {
  const bar = event.target.closest?.("[data-upload]")?.querySelector("[data-upload-progress]");
  if (bar) bar.hidden = true;
});
document.addEventListener("change", (event) => {
  if (!event.target.matches("[data-payload]")) return;
  for (const field of event.target.form.querySelectorAll("[data-new-payload]")) field.hidden = event.target.value !== "new";
});

watchTheRun();
