// A slab of heights that is shown, between two horizontal cuts.
import { element } from './dom.js';
import { formatCoarse } from './format.js';

const STEP_M = 0.01;

export class Section {
  // Heights are relative to the page's origin; zero_m, which people see as 0, is a floor's.
  // `above` says which.
  constructor(low_m, high_m, { zero_m, above }, changed) {
    this.above = above;
    this.range = [low_m, high_m];
    this.zero_m = zero_m;
    this.changed = changed;
    this.low_m = low_m;
    this.high_m = high_m;
    this.low = this.slider('Lower cut', low_m, () => this.set(+this.low.value, this.high_m));
    this.high = this.slider('Upper cut', high_m, () => this.set(this.low_m, +this.high.value));
    this.bar = element('div', { class: 'slab' });
    this.text = element('span', { class: 'value', id: 'section-text' });
    this.element = element('div', { class: 'double-slider' }, this.bar, this.low, this.high);
  }

  slider(label, value, input) {
    const [min, max] = this.range;
    return element('input', {
      type: 'range',
      min,
      max,
      step: STEP_M,
      value,
      'aria-label': label,
      oninput: input,
    });
  }

  set(low_m, high_m) {
    const [least, most] = this.range;
    this.low_m = Math.min(Math.max(low_m, least), most);
    this.high_m = Math.max(Math.min(high_m, most), this.low_m + STEP_M);
    this.low.value = this.low_m;
    this.high.value = this.high_m;
    this.show();
    this.changed(this.low_m, this.high_m);
  }

  show() {
    const [least, most] = this.range;
    const share = (value) => `${(100 * (value - least)) / (most - least)}%`;
    this.bar.style.left = share(this.low_m);
    this.bar.style.right = `calc(100% - ${share(this.high_m)})`;
    const [low, high] = [this.low_m, this.high_m].map((z) => formatCoarse(z - this.zero_m));
    this.text.textContent = `${low} to ${high} ${this.above}`;
  }

  holds({ z }) {
    return z >= this.low_m && z <= this.high_m;
  }
}
