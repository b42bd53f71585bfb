// Lines and marks: which are shown, and in what colour.
import { Color } from 'three';
import { scaleColour } from './theme.js';
import { WideLines } from './wide_lines.js';

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
    this.order = new Uint32Array(data.count); // the lines that are shown
    this.wide = new WideLines(WIDTH_PX);
    this.object = this.wide.object;
  }

  // Shows those for which isShown(index) holds, in the colours of a palette.
  update(isShown, colourBy, palette) {
    let count = 0;
    for (let i = 0; i < this.data.count; i++) {
      this.shown[i] = isShown(i) ? 1 : 0;
      if (this.shown[i]) this.order[count++] = i;
    }
    this.wide.show(this.data.ends, this.order, count, this.colours(colourBy, palette));
  }

  // The function from a line's index to its colour.
  colours(colourBy, palette) {
    const { data } = this;
    const background = new Color(palette.background);
    const ofMark = (own) => background.clone().lerp(own, MARK_SHARE);
    const ofCodes = (codes, names) => {
      const colours = names.map((name) => new Color(name));
      const lines = colours.map((colour) => colour.getHex());
      const marks = colours.map((colour) => ofMark(colour).getHex());
      return (index) => {
        const of = data.isMark(index) ? marks : lines;
        return of[codes[index]] ?? of[0];
      };
    };
    const ofSigma = (index) => {
      const place = sigmaPlace(data.sigma_m[index], data.sigmaRange_m);
      const own = scaleColour(palette.scale, place);
      return (data.isMark(index) ? ofMark(own) : own).getHex();
    };
    const functions = {
      axis: () => ofCodes(data.axis, palette.axis),
      kind: () => ofCodes(data.kind, palette.kind),
      age: () => ofCodes(data.recent, palette.age),
      sigma: () => ofSigma,
    };
    return functions[colourBy]();
  }
}

// Some lines once more, wide and in front of all.
export class LineHighlight {
  constructor() {
    this.wide = new WideLines(HIGHLIGHT_PX);
    Object.assign(this.wide.material, { depthTest: false, transparent: true });
    this.object = this.wide.object;
    this.object.renderOrder = 10;
    this.show([]);
  }

  setColour(colour) {
    this.colour = new Color(colour).getHex();
    this.show(this.ends);
  }

  // Pairs of ends, as x, y, z of one and the other; none hides it.
  show(ends) {
    this.ends = ends;
    this.object.visible = ends.length > 0;
    this.wide.showAll(ends, this.colour);
  }
}
