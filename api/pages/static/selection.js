// The one choice of samples that all pictures of a page share: ranges of columns, and a session. It is text in the address
// (`velocity:-0.1:0.1;load:150:240;session:session-01.csv`); what it is of, the service says.
import { keep, kept, takeAlong } from "./address.js";

const panel = document.querySelector("[data-choice]");
const place = (part) => panel.querySelector(`[data-${part}]`);
const nothing = panel && place("choice-figures").textContent;
const short = (value) => String(+value.toPrecision(8));

export function parse(text) {
  const choice = { session: null, ranges: {} };
  for (const part of text.split(";").filter(Boolean)) {
    const [name, low, high] = part.split(":");
    if (name === "session" && high === undefined) choice.session = decodeURIComponent(low);
    else choice.ranges[decodeURIComponent(name)] = [Number(low), Number(high)];
  }
  return choice;
}

function textOf({ session, ranges }) {
  const parts = Object.entries(ranges ?? {}).map(([column, [low, high]]) => `${encodeURIComponent(column)}:${short(low)}:${short(high)}`);
  if (session) parts.push(`session:${encodeURIComponent(session)}`);
  return parts.join(";");
}

let chosen = kept("chosen");
export const chosenText = () => chosen;
export const chosenNow = () => parse(chosen);

// choice : { session, ranges: { column: [low, high] } }, or null for none; the same again takes it back
export function choose(choice) {
  const text = choice ? textOf(choice) : "";
  chosen = text === chosen ? "" : text;
  keep("chosen", chosen);
  tell();
}

let pending = null;
async function tell() {
  pending?.abort();
  pending = new AbortController();
  document.dispatchEvent(new CustomEvent("samples-chosen", { detail: null }));
  for (const button of document.querySelectorAll("[data-choose-session]"))
    button.setAttribute("aria-pressed", String(button.dataset.chooseSession === chosenNow().session));
  for (const part of ["choice-words", "clear-choice"]) place(part).hidden = !chosen;
  for (const key of document.querySelectorAll("[data-choice-key]")) key.hidden = !chosen;
  panel.classList.toggle("some", Boolean(chosen));
  const say = (words, figures) => {
    place("choice-words").textContent = words;
    place("choice-figures").textContent = figures;
  };
  if (!chosen) return say("", nothing);
  try {
    const response = await fetch(`${panel.dataset.choice}&${new URLSearchParams({ chosen })}`, { signal: pending.signal, headers: { Accept: "application/json" } });
    const found = await response.json();
    if (!response.ok) throw new Error(found.detail);
    say(found.words, found.figures);
    document.dispatchEvent(new CustomEvent("samples-chosen", { detail: found }));
  } catch (failure) {
    if (failure.name !== "AbortError") say("This choice cannot be shown.", `${failure.message} Clear it, and choose again.`);
  }
}

if (panel) {
  place("clear-choice").addEventListener("click", () => choose(null));
  for (const button of document.querySelectorAll("[data-choose-session]"))
    button.addEventListener("click", () => choose({ session: button.dataset.chooseSession, ranges: {} }));
  for (const name of ["chosen", "x", "y"]) takeAlong(name, kept(name));
  // Every picture listens before the choice that came with the address is told.
  document.addEventListener("DOMContentLoaded", () => chosen && tell());
}
