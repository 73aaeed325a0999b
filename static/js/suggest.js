// The models that an endpoint lists are offered where one is named.
const field = document.querySelector("[data-listed]");
if (field) {
  const { models, problem } = await (await fetch(field.dataset.listed)).json();
  field.list.append(...models.map((name) => Object.assign(document.createElement("option"), { value: name })));
  const count = `The server lists ${models.length} more: they are suggested as you type.`;
  document.getElementById(field.getAttribute("aria-describedby")).textContent = problem
    ? `The server lists no models: ${problem}`
    : models.length ? count : "";
}
