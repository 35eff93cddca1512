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
  button.querySelector("[data-theme-word]").textContent = next[0].toUpperCase() + next.slice(1);
  document.dispatchEvent(new CustomEvent("theme-changed"));
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-theme-toggle]");
  if (button) toggleTheme(button);
});

document.addEventListener("change", (event) => {
  if (!event.target.matches("[data-submit]")) return;
  const { form } = event.target;
  // A form that is only drawn anew may still lack what it will need: a choice is taken back without filling it in.
  const checked = form.noValidate;
  form.noValidate = form.method === "get" || checked;
  form.requestSubmit();
  form.noValidate = checked;
});

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
  document.dispatchEvent(new CustomEvent("theme-changed")),
);

// Paper is light: what a canvas holds is drawn in light colours while the page is printed.
let chosenTheme;
addEventListener("beforeprint", () => {
  chosenTheme = document.documentElement.dataset.theme;
  document.documentElement.dataset.theme = "light";
  document.dispatchEvent(new CustomEvent("theme-changed"));
});
addEventListener("afterprint", () => {
  if (chosenTheme) document.documentElement.dataset.theme = chosenTheme;
  else delete document.documentElement.dataset.theme;
});
matchMedia("print").addEventListener("change", ({ matches }) => {
  if (!matches) document.dispatchEvent(new CustomEvent("theme-changed"));
});

// The guard asks for the token with everything that changes something.
document.addEventListener("htmx:configRequest", (event) => {
  event.detail.headers.Accept = "text/html";
  event.detail.headers["X-CSRF-Token"] = document.querySelector('meta[name="csrf-token"]').content;
});

// What went wrong is said in one place, and stays until the user acts: puts it away, or does something else. What a page
// asks for by itself (news, progress) is no act, and neither is the fresh page that it may bring.
const KEPT = "problem";
function forget() {
  sessionStorage.removeItem(KEPT);
  document.querySelector("#problem")?.replaceChildren();
}
function keep(words) {
  sessionStorage.setItem(KEPT, JSON.stringify({ page: location.pathname, words }));
}
function say(words) {
  const place = document.querySelector("#problem");
  if (!place) return;
  const message = document.createElement("div");
  message.className = "message warn problem";
  const said = document.createElement("p");
  said.textContent = words;
  const away = document.createElement("button");
  away.type = "button";
  away.className = "quiet";
  away.textContent = "Dismiss";
  away.dataset.dismiss = "";
  message.append(said, away);
  place.replaceChildren(message);
  keep(words);
  message.scrollIntoView({ block: "nearest" });
}
document.addEventListener("click", (event) => {
  const away = event.target.closest("[data-dismiss]");
  if (!away) return;
  away.closest(".message").remove();
  forget();
});
document.addEventListener("htmx:afterSwap", ({ detail }) => {
  const said = detail.target.id === "problem" && detail.target.querySelector("p");
  if (said) keep(said.textContent);
});
document.addEventListener("htmx:beforeRequest", (event) => {
  const { requestConfig } = event.detail;
  const byItself = requestConfig.verb === "get" || requestConfig.triggeringEvent?.type === "load";
  if (!byItself) forget();
});
const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
if (kept?.page === location.pathname && performance.getEntriesByType("navigation")[0]?.type === "reload") say(kept.words);
else sessionStorage.removeItem(KEPT);

// A form that is drawn anew with every choice keeps what was typed, until it has done its work.
const typing = document.querySelector("form[data-keeps-typed]");
if (typing) {
  const place = `typed ${location.pathname}`;
  const fields = () => [...typing.querySelectorAll("input[name]:not([type=hidden])")];
  const typed = JSON.parse(sessionStorage.getItem(place) ?? "{}");
  for (const field of fields()) {
    if (field.type === "radio") field.checked = typed[field.name] === undefined ? field.checked : typed[field.name] === field.value;
    else field.value = typed[field.name] ?? field.value;
  }
  typing.addEventListener("input", ({ target }) => {
    if (!fields().includes(target)) return;
    typed[target.name] = target.value;
    sessionStorage.setItem(place, JSON.stringify(typed));
  });
  document.addEventListener("htmx:afterRequest", ({ detail }) => {
    if (detail.successful && detail.elt.matches("[data-ends-typing]")) sessionStorage.removeItem(place);
  });
}

// A fresh page must not take away what somebody is typing: it is offered instead.
document.addEventListener("input", (event) => {
  const form = event.target.closest("main form");
  if (form) form.dataset.changed = "yes";
});
document.addEventListener("submit", (event) => delete event.target.dataset.changed);
document.addEventListener("htmx:beforeOnLoad", (event) => {
  const { xhr, elt } = event.detail;
  if (!xhr.getResponseHeader("HX-Refresh") || !elt.matches(".news") || !document.querySelector("[data-changed]")) return;
  event.preventDefault();
  const message = document.createElement("div");
  message.className = "message";
  const again = document.createElement("button");
  again.type = "button";
  again.textContent = "Show it";
  again.addEventListener("click", () => location.reload());
  message.append("A new fit is ready. ", again);
  elt.removeAttribute("hx-get");
  elt.replaceChildren(message);
});
// What somebody asked for goes before news: a fresh page that a poll brings meanwhile would break it off, or take the place of
// the page that it leads to. It is drawn afterwards, where the page stays.
const ACT = { underWay: 0, leadsAway: false, news: false, given: 0 };
// ms that a page which a link or a form leads to may take. What was a file to be kept, or was given up, never comes.
const ARRIVAL = 20_000;
// what changes something, and what a person's click, key or choice asks for; not what a page asks for by itself
const isAct = ({ requestConfig }) => requestConfig.verb !== "get" || requestConfig.triggeringEvent?.isTrusted === true;
function drawnAfterwards() {
  if (ACT.news && !ACT.underWay && !ACT.leadsAway) location.reload();
}
document.addEventListener("htmx:beforeSend", ({ detail }) => {
  if (isAct(detail)) ACT.underWay += 1;
});
document.addEventListener("htmx:beforeOnLoad", (event) => {
  const { xhr } = event.detail;
  const leadsAway = xhr.getResponseHeader("HX-Redirect") !== null;
  if (!leadsAway && !xhr.getResponseHeader("HX-Refresh")) return;
  if (isAct(event.detail) || !(ACT.underWay || ACT.leadsAway)) {
    ACT.leadsAway ||= leadsAway;
    return;
  }
  event.preventDefault();
  ACT.news = true;
});
document.addEventListener("htmx:afterRequest", ({ detail }) => {
  if (!isAct(detail)) return;
  ACT.underWay -= 1;
  drawnAfterwards();
});
addEventListener("beforeunload", () => {
  ACT.leadsAway = true;
  clearTimeout(ACT.given);
  ACT.given = setTimeout(() => {
    ACT.leadsAway = false;
    drawnAfterwards();
  }, ARRIVAL);
});
addEventListener("pageshow", () => (ACT.leadsAway = false));
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
  const form = event.target.closest?.("[data-upload]");
  if (!form) return;
  form.querySelector("[data-upload-progress]").hidden = true;
  // Where choosing a file sends it, the same file can be chosen again once it was put right.
  if (form.querySelector("input[data-submit]")) form.reset();
});
document.addEventListener("change", (event) => {
  if (!event.target.matches("[data-payload]")) return;
  for (const field of event.target.form.querySelectorAll("[data-new-payload]")) field.hidden = event.target.value !== "new";
});

// Where what had the focus is gone from a part that was exchanged, the focus goes to what comes next there: a keyboard goes on
// from it, and a screen reader reads it.
const asked = new WeakSet();
document.addEventListener("htmx:beforeRequest", ({ detail }) => {
  if (detail.elt.contains(document.activeElement)) asked.add(detail.elt);
});
document.addEventListener("htmx:beforeSwap", ({ detail }) => {
  const here = document.activeElement;
  if (here !== document.body && detail.target?.contains(here)) asked.add(detail.requestConfig.elt);
});
document.addEventListener("htmx:afterSettle", ({ detail }) => {
  const gone = asked.has(detail.requestConfig?.elt) && document.activeElement === document.body;
  if (!gone) return;
  const next = document.querySelector("main [data-next-focus]") ?? detail.target;
  if (next.matches("div")) next.tabIndex = -1;
  next.focus({ preventScroll: true });
});

// A page that is loaded again, because of a choice in it or of news, has the focus where it was: in a part that a computation
// has filled, on what can be done there now.
function focusAt(place) {
  place?.focus({ preventScroll: true });
  if (place && document.activeElement !== place) place.querySelector("a[href], button:not(:disabled)")?.focus({ preventScroll: true });
}
const FOCUS = "focus";
addEventListener("pagehide", () => {
  const here = document.activeElement;
  const named = here?.name && `[name="${CSS.escape(here.name)}"]`;
  const place = here?.id ? `#${CSS.escape(here.id)}` : here?.matches("[data-next-focus]") ? "[data-next-focus]" : named;
  if (place && here.matches("main :focus-visible")) sessionStorage.setItem(FOCUS, JSON.stringify({ page: location.pathname, place }));
  else sessionStorage.removeItem(FOCUS);
});
const before = JSON.parse(sessionStorage.getItem(FOCUS) ?? "null");
if (before?.page === location.pathname && document.activeElement === document.body)
  focusAt(document.querySelector(`main ${before.place}`));

// A screen reader hears of progress at every quarter, and of what it is the progress of.
const PROGRESS = "main progress[aria-label]:not([hidden]), [data-run-bar]:not([hidden]) progress";
let announced = "";
function announce() {
  const bar = document.querySelector(PROGRESS);
  const words = bar ? `${bar.getAttribute("aria-label")}: ${25 * Math.floor(4 * bar.value)} %` : announced ? "Done." : "";
  if (words === announced || (words === "Done." && announced === "")) return;
  announced = words === "Done." ? "" : words;
  // What came to nothing says so itself.
  const failed = words === "Done." && document.querySelector("main [role=alert]:not(:empty)");
  const place = document.querySelector("[data-announcer]");
  if (place) place.textContent = failed ? "" : words;
}
document.addEventListener("htmx:afterSettle", announce);
document.addEventListener("run-shown", announce);

// What somebody has unfolded stays so when a page exchanges the part that it stands in.
let unfolded = [];
document.addEventListener("htmx:beforeSwap", ({ detail }) => {
  unfolded = [...(detail.target?.querySelectorAll("details[open][id]") ?? [])].map((each) => each.id);
});
document.addEventListener("htmx:afterSwap", () => {
  for (const id of unfolded) document.getElementById(id)?.setAttribute("open", "");
});

// What scrolls sideways can be scrolled from the keyboard too: it takes the focus as long as it does, under its heading's name.
const SCROLLING = "main .scroll, main .equation";
const sized = new ResizeObserver((entries) => entries.forEach(({ target }) => takeFocus(target)));
function takeFocus(place) {
  if (place.scrollWidth <= place.clientWidth) {
    for (const name of ["tabindex", "role", "aria-label"]) place.removeAttribute(name);
    return;
  }
  place.tabIndex = 0;
  place.setAttribute("role", "group");
  place.setAttribute("aria-label", place.closest("section")?.querySelector("h1, h2, h3")?.textContent ?? "Table");
}
function watchScrolling() {
  for (const place of document.querySelectorAll(SCROLLING)) sized.observe(place);
}
document.addEventListener("htmx:afterSettle", watchScrolling);
watchScrolling();

// Keys without Ctrl or Alt can be switched off, for whoever dictates or uses a switch; Esc always stops.
const keys = document.querySelector("[data-single-keys]");
if (keys) {
  keys.checked = localStorage.getItem("single-keys") !== "off";
  keys.addEventListener("change", () => localStorage.setItem("single-keys", keys.checked ? "on" : "off"));
}

watchTheRun();
