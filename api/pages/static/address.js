// What a page shows stands in its address, so that it can be sent and comes back with the page. Links and forms that are
// marked take it along.

export const kept = (name) => new URLSearchParams(location.search).get(name) ?? "";

export function keep(name, value) {
  const address = new URL(location.href);
  if (value) address.searchParams.set(name, value);
  else address.searchParams.delete(name);
  history.replaceState(history.state, "", address);
  takeAlong(name, value);
}

export function takeAlong(name, value) {
  for (const link of document.querySelectorAll("[data-takes-along] a, a[data-takes-along]")) {
    const target = new URL(link.href);
    if (value) target.searchParams.set(name, value);
    else target.searchParams.delete(name);
    link.href = target.href;
  }
  for (const form of document.querySelectorAll("form[data-takes-along]")) {
    let field = form.querySelector(`input[name="${name}"]`);
    if (!value) {
      field?.remove();
      continue;
    }
    if (!field) {
      field = document.createElement("input");
      field.type = "hidden";
      field.name = name;
      form.append(field);
    }
    field.value = value;
  }
}
