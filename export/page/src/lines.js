// Lines and marks: which are shown, in what colour, and as what.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Group,
  LineBasicMaterial,
  LineSegments,
} from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
import { scaleColour } from './theme.js';

const WIDTH_PX = 2;
const HIGHLIGHT_PX = 4.5;
const MARK_SHARE = 0.45; // of a mark's own colour; the rest is background

// What is known of all lines, the marks behind them.
export class LineData {
  constructor({ document, arrays }) {
    this.ends = arrays.line_ends;
    this.id = arrays.line_id;
    this.axis = arrays.line_axis;
    this.kind = arrays.line_kind;
    this.recent = arrays.line_recent;
    this.world = arrays.line_world;
    this.observations = arrays.line_observations;
    this.sigma_m = arrays.line_sigma;
    this.deviation_rad = arrays.line_deviation;
    this.deviationSigma_rad = arrays.line_deviation_sigma;
    this.count = this.id.length;
    this.lines = this.count - document.marks;
    this.sigmaRange_m = percentiles(this.sigma_m, 0.02, 0.98);
  }

  isMark(index) {
    return index >= this.lines;
  }

  length_m(index) {
    const e = this.ends;
    const i = 6 * index;
    return Math.hypot(e[i + 3] - e[i], e[i + 4] - e[i + 1], e[i + 5] - e[i + 2]);
  }

  // The pieces of a line that has gaps: those of its id.
  piecesOf(index) {
    const [from, to] = this.isMark(index) ? [this.lines, this.count] : [0, this.lines];
    const pieces = [];
    for (let i = from; i < to; i++) if (this.id[i] === this.id[index]) pieces.push(i);
    return pieces;
  }
}

function percentiles(values, low, high) {
  if (values.length === 0) return [1e-3, 1e-2];
  const sorted = Float32Array.from(values).sort();
  const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
  return [Math.max(at(low), 1e-4), Math.max(at(high), 2e-4)];
}

// The place of a standard deviation on a logarithmic scale, in [0, 1] within the range.
export function sigmaPlace(sigma_m, [low_m, high_m]) {
  return Math.log(Math.max(sigma_m, 1e-6) / low_m) / Math.log(high_m / low_m);
}

export class LineLayer {
  constructor(data) {
    this.data = data;
    this.shown = new Uint8Array(data.count); // by the layers that are on
    this.order = new Uint32Array(data.count); // the lines that are shown, in the buffers' order
    this.fat = new LineSegments2(
      fatGeometry(data.count),
      new LineMaterial({
        linewidth: WIDTH_PX,
        vertexColors: true,
      }),
    );
    this.thin = new LineSegments(
      thinGeometry(data.count),
      new LineBasicMaterial({ vertexColors: true }),
    );
    for (const object of [this.fat, this.thin]) object.frustumCulled = false;
    this.object = new Group();
    this.object.add(this.fat, this.thin);
    this.useThin(false);
  }

  // Lines a pixel wide are drawn much faster.
  useThin(thin) {
    this.thin.visible = thin;
    this.fat.visible = !thin;
  }

  // Shows those for which isShown(index) holds, in the colours of a palette.
  update(isShown, colourBy, palette) {
    let count = 0;
    for (let i = 0; i < this.data.count; i++) {
      this.shown[i] = isShown(i) ? 1 : 0;
      if (this.shown[i]) this.order[count++] = i;
    }
    this.fill(count, colourBy, palette);
  }

  fill(count, colourBy, palette) {
    const positions = this.fat.geometry.attributes.instanceStart.data;
    const colours = this.fat.geometry.attributes.instanceColorStart.data;
    const { ends } = this.data;
    const colourOf = this.colours(colourBy, palette);
    for (let k = 0; k < count; k++) {
      const index = this.order[k];
      for (let j = 0; j < 6; j++) positions.array[6 * k + j] = ends[6 * index + j];
      const { r, g, b } = colourOf(index);
      for (let j = 0; j < 6; j += 3) {
        colours.array[6 * k + j] = r;
        colours.array[6 * k + j + 1] = g;
        colours.array[6 * k + j + 2] = b;
      }
    }
    const { position, color } = this.thin.geometry.attributes;
    position.array.set(positions.array.subarray(0, 6 * count));
    color.array.set(colours.array.subarray(0, 6 * count));
    for (const buffer of [positions, colours, position, color]) buffer.needsUpdate = true;
    this.fat.geometry.instanceCount = count;
    this.thin.geometry.setDrawRange(0, 2 * count);
  }

  // The function from a line's index to its colour.
  colours(colourBy, palette) {
    const { data } = this;
    const background = new Color(palette.background);
    const ofCodes = (codes, names) => {
      const colours = names.map((name) => new Color(name));
      return (index) => colours[codes[index]] ?? colours[0];
    };
    const functions = {
      axis: () => ofCodes(data.axis, palette.axis),
      kind: () => ofCodes(data.kind, palette.kind),
      age: () => ofCodes(data.recent, palette.age),
      sigma: () => (index) =>
        scaleColour(palette.scale, sigmaPlace(data.sigma_m[index], data.sigmaRange_m)),
    };
    const own = functions[colourBy]();
    return (index) =>
      data.isMark(index) ? background.clone().lerp(own(index), MARK_SHARE) : own(index);
  }
}

function fatGeometry(count) {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(new Float32Array(6 * count));
  geometry.setColors(new Float32Array(6 * count));
  geometry.instanceCount = 0;
  return geometry;
}

function thinGeometry(count) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(6 * count), 3));
  geometry.setAttribute('color', new BufferAttribute(new Float32Array(6 * count), 3));
  geometry.setDrawRange(0, 0);
  return geometry;
}

// Some lines once more, wide and in front of all.
export class LineHighlight {
  constructor() {
    const material = new LineMaterial({
      linewidth: HIGHLIGHT_PX,
      depthTest: false,
      transparent: true,
    });
    this.object = new LineSegments2(new LineSegmentsGeometry(), material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 10;
    this.object.visible = false;
  }

  setColour(colour) {
    this.object.material.color.set(colour);
  }

  // Pairs of ends, as x, y, z of one and the other; none hides it.
  show(ends) {
    this.object.visible = ends.length > 0;
    if (ends.length === 0) return;
    this.object.geometry.dispose();
    this.object.geometry = new LineSegmentsGeometry().setPositions(ends);
  }
}
