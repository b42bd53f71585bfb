// Rooms as tinted floors with their names, and walls as a plan draws them: cut, filled.
import {
  DoubleSide,
  Group,
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

// A wall runs, seen from the side of its face, from right to left; its thickness is behind.
function wallShapes(wall) {
  const start = new Vector2(...wall.start);
  const along = new Vector2(...wall.end).sub(start);
  const length_m = along.length();
  along.normalize();
  const behind = new Vector2(along.y, -along.x).multiplyScalar(wall.thickness_m);
  return solidParts(wall, length_m).map(([from, to]) => {
    const a = start.clone().addScaledVector(along, from);
    const b = start.clone().addScaledVector(along, to);
    return new Shape([a, b, b.clone().add(behind), a.clone().add(behind)]);
  });
}

export class WallPlan {
  constructor({ walls, storeys }) {
    this.count = walls.length;
    this.material = new MeshBasicMaterial({ side: DoubleSide });
    this.object = new Group();
    for (const storey of storeys) {
      const shapes = walls.filter((wall) => wall.storey === storey.id).flatMap(wallShapes);
      const mesh = new Mesh(new ShapeGeometry(shapes), this.material);
      mesh.position.z = storey.floor_m + CUT_M;
      this.object.add(mesh);
    }
    this.object.visible = false;
  }

  setPalette(palette) {
    this.material.color.set(palette.poche);
  }
}
