// Measuring: two picks, the distance between them and how certain it is.
import { Vector3 } from 'three';
import { distanceBetween } from './distance.js';
import { element } from './dom.js';
import { formatAngle, formatLength, formatSigma } from './format.js';
import { LineHighlight } from './lines.js';

const OF_95_PERCENT = 1.96; // standard deviations

// What can be measured of a pick.
export function measurable(pick, layers) {
  const { data } = layers.lines;
  if (pick.type === 'line' && pick.end) {
    return { type: 'point', at: pick.end, sigma_m: data.sigma_m[pick.index] };
  }
  if (pick.type === 'line') {
    const at = (which) => new Vector3().fromArray(data.ends, 6 * pick.index + 3 * which);
    return { type: 'line', a: at(0), b: at(1), sigma_m: data.sigma_m[pick.index] };
  }
  if (pick.type === 'plane') {
    const { direction, offset_m, centre, sigma_m } = pick.plane;
    return { type: 'plane', normal: direction, offset_m, centre, sigma_m };
  }
  const cloud = { landmark: layers.landmarks, dense: layers.dense }[pick.type];
  return { type: 'point', at: pick.point, sigma_m: cloud.sigmaOf(pick.index) };
}

export class Measure {
  constructor(view, labels, layers) {
    this.view = view;
    this.layers = layers;
    this.picks = [];
    this.result = null;
    this.line = new LineHighlight();
    view.scene.add(this.line.object);
    this.label = labels.add(new Vector3(), () => this.result !== null, { class: 'distance' });
  }

  // Takes a pick as the first or the second; a third begins anew.
  take(pick) {
    if (this.picks.length === 2) this.clear();
    this.picks.push(pick);
    if (this.picks.length === 2) this.measure();
    this.view.invalidate();
  }

  clear() {
    this.picks = [];
    this.result = null;
    this.line.show([]);
    this.view.invalidate();
  }

  measure() {
    const [first, second] = this.picks.map((pick) => measurable(pick, this.layers));
    this.result = distanceBetween(first, second);
    const { from, to, distance_m, angle_rad } = this.result;
    this.line.show([...from, ...to]);
    this.label.position.addVectors(from, to).multiplyScalar(0.5);
    this.label.element.textContent =
      distance_m === undefined ? formatAngle(angle_rad) : formatLength(distance_m);
  }

  // What to do next.
  prompt(of) {
    return [
      `Pick the first ${of}`,
      `Now pick the second ${of}`,
      `Pick another ${of} to measure anew`,
    ][this.picks.length];
  }

  // Rows of name and value.
  rows() {
    if (!this.result) return [];
    const { distance_m, sigma_m, angle_rad, from, to, how } = this.result;
    const rows = [];
    if (distance_m !== undefined) {
      const apart = new Vector3().subVectors(to, from);
      rows.push(
        ['Distance', formatLength(distance_m)],
        ['95 % within', `± ${formatSigma(OF_95_PERCENT * sigma_m)} (1 σ: ${formatSigma(sigma_m)})`],
        ['Horizontally', formatLength(Math.hypot(apart.x, apart.y))],
        ['In height', formatLength(Math.abs(apart.z))],
      );
    }
    if (angle_rad !== undefined) rows.push(['Angle', formatAngle(angle_rad)]);
    rows.push(['Measured', how]);
    return rows;
  }
}

// A table of rows of name and value.
export function rowTable(rows) {
  return element(
    'dl',
    {},
    ...rows.flatMap(([name, value]) => [element('dt', {}, name), element('dd', {}, value)]),
  );
}
