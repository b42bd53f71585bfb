// Elements of the page.

export function byId(id) {
  return document.getElementById(id);
}

// element('div', { class: 'row', onclick: f }, 'text', child...)
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, '');
    else if (value !== false && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

// One of several, as a row of buttons. Calls choose(value); returns the element, whose select(value)
// shows another choice.
export function choiceRow(label, choices, chosen, choose) {
  const row = element('div', { class: 'choices', role: 'radiogroup', 'aria-label': label });
  row.select = (value) => {
    for (const button of row.children) {
      button.setAttribute('aria-checked', String(button.value === String(value)));
    }
  };
  for (const [value, name] of choices) {
    row.append(
      element(
        'button',
        { type: 'button', role: 'radio', value, onclick: () => choose(value) },
        name,
      ),
    );
  }
  row.select(chosen);
  return row;
}
