// What the page says of what is under the pointer: a title and rows of name and value.
import { formatAngle, formatArea, formatCount, formatLength, formatSigma, formatTime } from './format.js';
import { AXES, KINDS } from './theme.js';

export class Describer {
  constructor({ document }, { lines, landmarks, dense, pictures }) {
    this.document = document;
    this.lines = lines.data;
    this.landmarks = landmarks;
    this.dense = dense;
    this.pictures = pictures;
  }

  describe(pick) {
    return {
      line: () => this.line(pick),
      landmark: () => this.landmark(pick),
      dense: () => this.densePoint(pick),
      plane: () => this.plane(pick),
      picture: () => this.picture(pick),
    }[pick.type]();
  }

  line({ index, end }) {
    const { lines } = this;
    const name = `${lines.isMark(index) ? 'Mark' : 'Line'} ${lines.id[index]}`;
    const pieces = lines.piecesOf(index);
    const rows = [
      ['Length', formatLength(lines.length_m(index))],
      ['Seen by', lines.observations[index] > 0 ? `${formatCount(lines.observations[index])} views` : 'no view: planes meet there'],
      ['Sigma across', formatSigma(lines.sigma_m[index])],
      ['Kind', KINDS[lines.kind[index]] ?? KINDS[0]],
      ['Axis', this.axisOf(index)],
    ];
    if (pieces.length > 1) {
      const all_m = pieces.reduce((sum, piece) => sum + lines.length_m(piece), 0);
      rows.splice(1, 0, ['With gaps', `${formatLength(all_m)} in ${pieces.length} pieces`]);
    }
    if (lines.deviationSigma_rad[index] > 0) {
      const sigma = formatAngle(lines.deviationSigma_rad[index]);
      rows.push(['Off its axis', `${formatAngle(lines.deviation_rad[index])} (sigma ${sigma})`]);
    }
    return { title: end ? `End of ${name.toLowerCase()}` : name, rows };
  }

  axisOf(index) {
    const name = AXES[this.lines.axis[index]] ?? AXES[3];
    const world = this.lines.world[index];
    return world < 0 ? name : `${name}, world ${world}`;
  }

  landmark({ index, point }) {
    return {
      title: `Point ${index}`,
      rows: [
        ['Seen', `${formatCount(this.landmarks.observations[index])} times`],
        ['Sigma', formatSigma(this.landmarks.sigmaOf(index))],
        this.place(point),
      ],
    };
  }

  densePoint({ index, point }) {
    const title = this.dense.isFilled(index)
      ? 'Point of a filled plane'
      : 'Point of the dense cloud';
    return { title, rows: [['Sigma', formatSigma(this.dense.sigmaOf(index))], this.place(point)] };
  }

  picture({ index, point }) {
    return {
      title: `Keyframe ${this.pictures.keyframeOf(index)}`,
      rows: [['Time', formatTime(this.pictures.time_s(index))], this.place(point)],
    };
  }

  place(point) {
    const world = point.toArray().map((value, axis) => value + this.document.origin[axis]);
    return ['At', world.map((value) => value.toFixed(3)).join(', ')];
  }

  plane({ plane }) {
    const names = { wall: 'Wall', floor: 'Floor', ceiling: 'Ceiling', other: 'Plane' };
    const rows = [
      ['Area', formatArea(plane.area_m2)],
      ['Sigma of offset', formatSigma(plane.sigma_m)],
      ['Storey', String(plane.storey)],
    ];
    if (plane.inferred) rows.push(['Seen', plane.kind === 'wall' ? 'the other side only' : 'hardly']);
    if (plane.rooms.length > 0)
      rows.push([plane.rooms.length > 1 ? 'Rooms' : 'Room', plane.rooms.map((id) => id + 1).join(', ')]);
    for (const { kind, width_m, height_m } of plane.openings) {
      const name = kind[0].toUpperCase() + kind.slice(1);
      rows.push([name, `${formatLength(width_m)} × ${formatLength(height_m)}`]);
    }
    return { title: `${names[plane.kind]} ${plane.id}`, rows };
  }
}
