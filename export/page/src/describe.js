// What the page says of what is under the pointer: a title and rows of name and value.
import {
  formatAngle,
  formatArea,
  formatCoarse,
  formatCount,
  formatLength,
  formatShare,
  formatSigma,
  formatTime,
} from './format.js';
import { rowsInGrid } from './grid.js';
import { titleOfRoom, titleOfStorey } from './names.js';
import { AXES, KINDS } from './theme.js';

export class Describer {
  constructor({ document }, { lines, landmarks, dense, pictures }) {
    this.document = document;
    this.lines = lines.data;
    this.landmarks = landmarks;
    this.dense = dense;
    this.pictures = pictures;
    const { storeys, walls } = document.building;
    this.zero_m = storeys.length > 0 ? storeys[0].floor_m : null;
    this.wallOfPlane = new Map(walls.flatMap((wall) => wall.planes.map((id) => [id, wall])));
    this.worlds = new Set(this.lines.world.filter((world) => world >= 0)).size;
  }

  describe(pick) {
    const { title, rows } = this.ofKind(pick);
    return { title, rows: [...rows, ...this.inGrid(pick.end ?? pick.point)] };
  }

  ofKind(pick) {
    return {
      line: () => this.line(pick),
      landmark: () => this.landmark(pick),
      dense: () => this.densePoint(pick),
      plane: () => this.plane(pick),
      picture: () => this.picture(pick),
    }[pick.type]();
  }

  inGrid(point) {
    return point ? rowsInGrid(this.document.georeference, this.toWorld(point)) : [];
  }

  toWorld(point) {
    return point.toArray().map((value, axis) => value + this.document.origin[axis]);
  }

  line({ index, end }) {
    const { lines } = this;
    const name = `${lines.isMark(index) ? 'Mark' : 'Line'} ${lines.id[index]}`;
    const pieces = lines.piecesOf(index);
    const rows = [
      ['Length', formatLength(lines.length_m(index))],
      ['Seen by', lines.observations[index] > 0 ? `${formatCount(lines.observations[index])} views` : 'no view: planes meet there'],
      ...this.heights([2, 5].map((k) => lines.ends[6 * index + k])),
      ['Uncertainty (1 σ)', formatSigma(lines.sigma_m[index])],
      ['Kind', KINDS[lines.kind[index]] ?? KINDS[0]],
      ['Direction', this.axisOf(index)],
    ];
    if (pieces.length > 1) {
      const all_m = pieces.reduce((sum, piece) => sum + lines.length_m(piece), 0);
      rows.splice(1, 0, ['With gaps', `${formatLength(all_m)} in ${pieces.length} pieces`]);
    }
    if (lines.deviationSigma_rad[index] > 0) {
      const sigma = formatAngle(lines.deviationSigma_rad[index]);
      rows.push(['Off that by', `${formatAngle(lines.deviation_rad[index])} (1 σ: ${sigma})`]);
    }
    return { title: end ? `End of ${name.toLowerCase()}` : name, rows };
  }

  axisOf(index) {
    const name = AXES[this.lines.axis[index]] ?? AXES[3];
    const world = this.lines.world[index];
    return world < 0 || this.worlds < 2 ? name : `${name}, heading ${world}`;
  }

  // Above the lowest floor, where there is one.
  heights(values) {
    if (this.zero_m === null) return [];
    const sorted = [...values].sort((a, b) => a - b);
    const above = [...new Set(sorted.map((z) => formatCoarse(z - this.zero_m)))];
    return [['Height above floor 0', above.join(' to ')]];
  }

  landmark({ index, point }) {
    return {
      title: `Point ${index}`,
      rows: [
        ['Seen', `${formatCount(this.landmarks.observations[index])} times`],
        ['Uncertainty (1 σ)', formatSigma(this.landmarks.sigmaOf(index))],
        ...this.place(point),
      ],
    };
  }

  densePoint({ index, point }) {
    const title = this.dense.isFilled(index)
      ? 'Point of a filled plane'
      : 'Point of the dense cloud';
    return {
      title,
      rows: [['Uncertainty (1 σ)', formatSigma(this.dense.sigmaOf(index))], ...this.place(point)],
    };
  }

  picture({ index, point }) {
    return {
      title: `Keyframe ${this.pictures.keyframeOf(index)}`,
      rows: [['Time', formatTime(this.pictures.time_s(index))], ...this.place(point)],
    };
  }

  place(point) {
    return [
      ...this.heights([point.z]),
      ['In the map (x, y, z)', `${this.toWorld(point).map((value) => value.toFixed(3)).join(', ')} m`],
    ];
  }

  plane({ plane }) {
    const wall = this.wallOfPlane.get(plane.id);
    const rows = [
      ['Area', formatArea(plane.area_m2)],
      ...(wall ? [['Thickness', this.thicknessOf(wall)]] : []),
      ['Uncertainty (1 σ)', formatSigma(plane.sigma_m)],
      ['Storey', this.storeyOf(plane)],
    ];
    if (typeof wall?.seen_share === 'number')
      rows.push(['In the map', `${formatShare(wall.seen_share)} of what was seen`]);
    if (plane.inferred) rows.push(['Seen', plane.kind === 'wall' ? 'the other side only' : 'hardly']);
    if (plane.rooms.length > 0)
      rows.push([plane.rooms.length > 1 ? 'Rooms' : 'Room', this.roomsOf(plane)]);
    for (const { kind, width_m, height_m } of plane.openings) {
      const name = kind[0].toUpperCase() + kind.slice(1);
      rows.push([name, `${formatLength(width_m)} × ${formatLength(height_m)}`]);
    }
    if (wall) rows.push(['Plane', String(plane.id)]);
    return { title: this.titleOf(plane, wall), rows };
  }

  storeyOf({ storey }) {
    const found = this.document.building.storeys.find(({ id }) => id === storey);
    return found ? titleOfStorey(found) : String(storey);
  }

  roomsOf({ rooms }) {
    const byNumber = (id) => {
      const room = this.document.building.rooms[id];
      return room?.name ? titleOfRoom(room) : id + 1;
    };
    return rooms.map(byNumber).join(', ');
  }

  // Walls by their number, which is that of the plan and of what CAD and BIM programs get.
  titleOf({ kind, id }, wall) {
    const names = { wall: 'Wall plane', floor: 'Floor', ceiling: 'Ceiling', other: 'Plane' };
    return wall ? `Wall ${wall.id}` : `${names[kind]} ${id}`;
  }

  thicknessOf({ thickness_m, thickness_assumed }) {
    const text = formatLength(thickness_m);
    return thickness_assumed ? `about ${text}: one side seen` : text;
  }
}
