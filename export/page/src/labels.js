// Texts at places in space.
import { element } from './dom.js';

export class Labels {
  constructor(view, container) {
    this.view = view;
    this.container = container;
    this.labels = [];
    view.onDraw.push(() => this.place());
  }

  // isShown() is asked at each frame. Returns the label, whose `position` may change.
  add(position, isShown, attributes, ...content) {
    const label = { position, isShown, element: element('div', attributes, ...content) };
    this.container.append(label.element);
    this.labels.push(label);
    return label;
  }

  place() {
    for (const label of this.labels) {
      const shown = label.isShown() && this.view.isInFront(label.position);
      label.element.hidden = !shown;
      if (!shown) continue;
      const { x, y } = this.view.toPixels(label.position);
      label.element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    }
  }
}
