// SPDX-License-Identifier: Apache-2.0
// Labelled controls. Each returns its element and calls change(value) when a user changes it.

let last_id = 0;

export function element(tag, properties = {}, children = []) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function labelled(label, control, output) {
  control.id = `control-${++last_id}`;
  const row = element("div", { className: output ? "row" : "row wide" }, [element("label", { htmlFor: control.id, textContent: label }), control]);
  if (output) {
    output.htmlFor = control.id;
    row.append(output);
  }
  return row;
}

export function slider(label, { min, max, step, value, text, change }) {
  const output = element("output");
  const input = element("input", { type: "range", min, max, step });
  input.value = value;
  const show = () => {
    output.textContent = text ? text(Number(input.value)) : input.value;
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.addEventListener("input", () => { show(); change(Number(input.value)); });
  show();
  return labelled(label, input, output);
}

export function choice(label, options, value, change) {
  const select = element("select", {}, Object.entries(options).map(([key, text]) => element("option", { value: key, textContent: text })));
  select.value = value;
  select.addEventListener("change", () => change(select.value));
  return labelled(label, select);
}

export function check_box(label, value, change) {
  const input = element("input", { type: "checkbox", checked: value });
  input.addEventListener("change", () => change(input.checked));
  return element("label", { className: "check" }, [input, label]);
}

export function radio(name, label, value, change) {
  const input = element("input", { type: "radio", name, checked: value });
  input.addEventListener("change", change);
  return element("label", {}, [input, element("span", { textContent: label })]);
}

export function push_button(label, action) {
  const made = element("button", { type: "button", textContent: label });
  made.addEventListener("click", action);
  return made;
}

export function text_field(label, value, change) {
  const input = element("input", { type: "text", value, maxLength: 80 });
  input.addEventListener("input", () => change(input.value));
  return labelled(label, input);
}

export function colour_field(label, value, change) {
  const input = element("input", { type: "color", value });
  input.addEventListener("input", () => change(input.value));
  return labelled(label, input);
}

export function file_button(label, accept, change) {
  const input = element("input", { type: "file", accept });
  input.setAttribute("aria-label", label);
  input.addEventListener("change", () => { if (input.files.length > 0) change(input.files[0]); input.value = ""; });
  return element("span", { className: "file" }, [element("span", { textContent: label }), input]);
}

/** Saves bytes as a file of this name. */
export function save_file(name, blob) {
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
