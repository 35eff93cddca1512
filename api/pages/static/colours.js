// A colour's role in the style sheet, as what it is now, in light or dark: for what a canvas draws.
export function colour(role, within = document.body) {
  const probe = document.createElement("span");
  probe.style.color = `var(--${role})`;
  within.append(probe);
  const resolved = getComputedStyle(probe).color;
  probe.remove();
  return resolved;
}
