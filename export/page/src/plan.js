// Rooms as tinted floors with their names, and walls as a plan draws them: cut, filled.
import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Path,
  Shape,
  ShapeGeometry,
  Vector2,
  Vector3,
} from 'three';
import { drawBehind } from './planes.js';

const TINT = 0.1;
const ABOVE_FLOOR_M = 0.01;
const CUT_M = 1.1; // above the floor, at which a plan cuts openings
const SHORTEST_M = 0.005; // piece of wall
const SWING_STEPS = 16;
const OPENING_KINDS = ['door', 'window', 'passage'];

function flat(points) {
  return points.map((point) => new Vector2(...point));
}

function roomShape({ outline, holes }) {
  const shape = new Shape(flat(outline));
  shape.holes = holes.map((hole) => new Path(flat(hole)));
  return shape;
}

// The point of a room that is farthest from its border, to a tenth of its size: where its name goes.
function labelPlace({ outline, holes }) {
  const rings = [outline, ...holes].map(flat);
  const xs = rings[0].map(({ x }) => x);
  const ys = rings[0].map(({ y }) => y);
  const [left, right, low, high] = [
    Math.min(...xs),
    Math.max(...xs),
    Math.min(...ys),
    Math.max(...ys),
  ];
  const STEPS = 24;
  let best = { place: rings[0][0], clear_m: -Infinity };
  for (let i = 1; i < STEPS; i++) {
    for (let j = 1; j < STEPS; j++) {
      const place = new Vector2(
        left + ((right - left) * i) / STEPS,
        low + ((high - low) * j) / STEPS,
      );
      const clear_m = insideBy(place, rings);
      if (clear_m > best.clear_m) best = { place, clear_m };
    }
  }
  return best.place;
}

// The distance to the nearest ring, negative outside.
function insideBy(place, rings) {
  let inside = false;
  let nearest = Infinity;
  for (const ring of rings) {
    ring.forEach((a, i) => {
      const b = ring[(i + 1) % ring.length];
      if (a.y > place.y !== b.y > place.y) {
        if (place.x < a.x + ((place.y - a.y) / (b.y - a.y)) * (b.x - a.x)) inside = !inside;
      }
      nearest = Math.min(nearest, distanceToSegment(place, a, b));
    });
  }
  return inside ? nearest : -nearest;
}

function distanceToSegment(point, a, b) {
  const along = b.clone().sub(a);
  const t = point.clone().sub(a).dot(along) / Math.max(along.lengthSq(), 1e-12);
  return point.distanceTo(a.clone().addScaledVector(along, Math.min(Math.max(t, 0), 1)));
}

export class RoomLayer {
  constructor(rooms) {
    this.rooms = rooms;
    this.material = new MeshBasicMaterial({ transparent: true, opacity: TINT, depthWrite: false });
    drawBehind(this.material, 0);
    this.object = new Group();
    for (const room of rooms) {
      const mesh = new Mesh(new ShapeGeometry(roomShape(room)), this.material);
      mesh.position.z = room.floor_m + ABOVE_FLOOR_M;
      this.object.add(mesh);
      const { x, y } = labelPlace(room);
      room.place = new Vector3(x, y, room.floor_m);
    }
  }

  setPalette(palette) {
    this.material.color.set(palette.room);
  }
}

// The parts of a wall between openings that the cut goes through, in metres from its start.
function solidParts({ openings }, length_m) {
  const cut = openings
    .filter(({ sill_m, height_m }) => sill_m < CUT_M && sill_m + height_m > CUT_M)
    .sort((a, b) => a.from_m - b.from_m);
  const parts = [];
  let from_m = 0;
  for (const opening of cut) {
    parts.push([from_m, opening.from_m]);
    from_m = Math.max(from_m, opening.to_m);
  }
  parts.push([from_m, length_m]);
  return parts.filter(([from, to]) => to - from > SHORTEST_M);
}

// Where a place is that far along a wall's face and behind it. Seen from the side of its face a wall
// runs from left to right, so that behind is to the left of its direction.
function placesOf(wall) {
  const start = new Vector2(...wall.start);
  const along = new Vector2(...wall.end).sub(start);
  const length_m = along.length();
  along.normalize();
  const behind = new Vector2(-along.y, along.x);
  const at = (along_m, behind_m) =>
    start.clone().addScaledVector(along, along_m).addScaledVector(behind, behind_m);
  return { at, length_m };
}

// The outlines of the parts of a wall that the cut goes through.
export function wallOutlines(wall) {
  const { at, length_m } = placesOf(wall);
  const depth_m = wall.thickness_m;
  return solidParts(wall, length_m).map(([from, to]) => [
    at(from, 0),
    at(to, 0),
    at(to, depth_m),
    at(from, depth_m),
  ]);
}

// As plans draw them, as pairs of points: of a door that was walked through its leaf and swing, of
// other doors the threshold, of windows the pane, of passages what is overhead.
export function openingStrokes(wall, { kind, walked, from_m, to_m }) {
  const { at } = placesOf(wall);
  const depth_m = wall.thickness_m;
  const across = (behind_m) => [at(from_m, behind_m), at(to_m, behind_m)];
  if (kind === 'door' && walked) return leafAndSwing(at, from_m, to_m - from_m);
  const strokes = [...across(0), ...across(depth_m)];
  return kind === 'window' ? [...strokes, ...across(0.5 * depth_m)] : strokes;
}

function leafAndSwing(at, from_m, width_m) {
  const swing = Array.from({ length: SWING_STEPS + 1 }, (_, i) => {
    const angle_rad = (Math.PI / 2) * (i / SWING_STEPS);
    return at(from_m + width_m * Math.cos(angle_rad), -width_m * Math.sin(angle_rad));
  });
  const strokes = [at(from_m, 0), swing[SWING_STEPS]];
  for (let i = 0; i < SWING_STEPS; i++) strokes.push(swing[i], swing[i + 1]);
  return strokes;
}

function strokesObject(strokes) {
  const geometry = new BufferGeometry().setFromPoints(strokes);
  return new LineSegments(geometry, new LineBasicMaterial());
}

export class WallPlan {
  constructor({ walls, storeys }) {
    this.count = walls.length;
    this.material = new MeshBasicMaterial({ side: DoubleSide });
    this.object = new Group();
    this.openings = [];
    for (const storey of storeys) {
      const own = walls.filter((wall) => wall.storey === storey.id);
      const shapes = own.flatMap(wallOutlines).map((outline) => new Shape(outline));
      const parts = [new Mesh(new ShapeGeometry(shapes), this.material), ...this.openingsOf(own)];
      for (const part of parts) part.position.z = storey.floor_m + CUT_M;
      this.object.add(...parts);
      for (const wall of own) this.placeName(wall, storey.floor_m + CUT_M);
    }
    this.object.visible = false;
  }

  openingsOf(walls) {
    return OPENING_KINDS.map((kind) => {
      const strokes = walls.flatMap((wall) =>
        wall.openings
          .filter((opening) => opening.kind === kind)
          .flatMap((opening) => openingStrokes(wall, opening)),
      );
      const object = strokesObject(strokes);
      this.openings.push({ kind, object });
      return object;
    });
  }

  // Where the number of a wall is written: in its middle.
  placeName(wall, height_m) {
    const { at, length_m } = placesOf(wall);
    wall.ends = [at(0, 0), at(length_m, 0)].map(({ x, y }) => new Vector3(x, y, height_m));
    const { x, y } = at(0.5 * length_m, 0.5 * wall.thickness_m);
    wall.place = new Vector3(x, y, height_m);
  }

  setPalette(palette) {
    this.material.color.set(palette.poche);
    for (const { kind, object } of this.openings) object.material.color.set(palette.opening[kind]);
  }
}

// Where something was built otherwise than it was planned: lines a little over the plan.
export class Deviations {
  constructor({ deviations, building: { storeys } }) {
    this.all = deviations;
    this.object = new Group();
    for (const part of deviations) {
      const floor_m = storeys.find(({ id }) => id === part.storey)?.floor_m ?? 0;
      const height_m = floor_m + CUT_M + ABOVE_FLOOR_M;
      part.ends = [part.start, part.end].map((end) => new Vector3(...end, height_m));
      part.place = part.ends[0].clone().lerp(part.ends[1], 0.5);
      part.object = strokesObject(part.ends);
      this.object.add(part.object);
    }
  }

  setPalette(palette) {
    for (const { status, object } of this.all) object.material.color.set(palette.status[status]);
  }
}
