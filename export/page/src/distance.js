// Distances between what can be measured: a point { type: 'point', at }, a line { type: 'line', a, b }
// and a plane { type: 'plane', normal, offset_m, centre }, each with sigma_m, its standard deviation
// (of points along the least certain direction, of lines and planes across them).
import { Vector3 } from 'three';

const PARALLEL_RAD = (2 * Math.PI) / 180; // at most

// Returns { distance_m, sigma_m, from, to, how } and, where it has a meaning, angle_rad; of planes
// that meet the angle only. The errors of the two are taken as independent.
export function distanceBetween(first, second) {
  const order = ['point', 'line', 'plane'];
  const swapped = order.indexOf(first.type) > order.indexOf(second.type);
  const [a, b] = swapped ? [second, first] : [first, second];
  const result = MEASURES[`${a.type} ${b.type}`](a, b);
  return { ...result, sigma_m: Math.hypot(a.sigma_m, b.sigma_m) };
}

const MEASURES = {
  'point point': (a, b) => between(a.at, b.at, 'between points'),
  'point line': (a, b) => between(a.at, footOnLine(a.at, b), 'perpendicular to the line'),
  'point plane': (a, b) => between(a.at, footOnPlane(a.at, b), 'perpendicular to the plane'),
  'line line': betweenLines,
  'line plane': betweenLineAndPlane,
  'plane plane': betweenPlanes,
};

function between(from, to, how) {
  return { distance_m: from.distanceTo(to), from, to, how };
}

function directionOf({ a, b }) {
  return new Vector3().subVectors(b, a).normalize();
}

function middleOf({ a, b }) {
  return new Vector3().addVectors(a, b).multiplyScalar(0.5);
}

// On the line of which a segment was seen.
function footOnLine(point, line) {
  const direction = directionOf(line);
  const along = new Vector3().subVectors(point, line.a).dot(direction);
  return line.a.clone().addScaledVector(direction, along);
}

function footOnPlane(point, { normal, offset_m }) {
  return point.clone().addScaledVector(normal, offset_m - normal.dot(point));
}

// Between directions that have no sense, in [0, pi / 2].
function angleBetween(u, v) {
  return Math.atan2(new Vector3().crossVectors(u, v).length(), Math.abs(u.dot(v)));
}

function betweenLines(first, second) {
  const angle_rad = angleBetween(directionOf(first), directionOf(second));
  if (angle_rad <= PARALLEL_RAD) {
    const from = footOnLine(middleOfBoth(first, second), first);
    return { ...between(from, footOnLine(from, second), 'between parallel lines'), angle_rad };
  }
  const [from, to] = closestOfLines(first, second);
  return { ...between(from, to, 'shortest between the lines'), angle_rad };
}

// The middle of the part in which two parallel lines lie side by side; of none, between them.
function middleOfBoth(first, second) {
  const direction = directionOf(first);
  const along = (point) => new Vector3().subVectors(point, first.a).dot(direction);
  const own = [0, along(first.b)];
  const others = [along(second.a), along(second.b)];
  const low = Math.max(Math.min(...own), Math.min(...others));
  const high = Math.min(Math.max(...own), Math.max(...others));
  return first.a.clone().addScaledVector(direction, 0.5 * (low + high));
}

// The nearest points of two lines that are not parallel, as far as they were seen.
function closestOfLines(first, second) {
  const u = new Vector3().subVectors(first.b, first.a);
  const v = new Vector3().subVectors(second.b, second.a);
  const w = new Vector3().subVectors(first.a, second.a);
  const [uu, uv, vv, uw, vw] = [u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w)];
  const clamp = (value) => Math.min(Math.max(value, 0), 1);
  let s = clamp((uv * vw - vv * uw) / (uu * vv - uv * uv));
  const t = clamp((uv * s + vw) / vv);
  s = clamp((uv * t - uw) / uu);
  return [first.a.clone().addScaledVector(u, s), second.a.clone().addScaledVector(v, t)];
}

function betweenLineAndPlane(line, plane) {
  const angle_rad = Math.PI / 2 - angleBetween(directionOf(line), plane.normal);
  if (angle_rad <= PARALLEL_RAD) {
    const from = middleOf(line);
    const how = 'between the line and the parallel plane';
    return { ...between(from, footOnPlane(from, plane), how), angle_rad };
  }
  const height = (point) => Math.abs(plane.normal.dot(point) - plane.offset_m);
  const from = height(line.a) < height(line.b) ? line.a : line.b;
  return { ...between(from, footOnPlane(from, plane), "from the line's nearer end"), angle_rad };
}

function betweenPlanes(first, second) {
  const angle_rad = angleBetween(first.normal, second.normal);
  if (angle_rad > PARALLEL_RAD) {
    return { angle_rad, from: first.centre, to: second.centre, how: 'the planes meet' };
  }
  const middle = new Vector3().addVectors(first.centre, second.centre).multiplyScalar(0.5);
  const from = footOnPlane(middle, first);
  const to = footOnPlane(middle, second);
  return { ...between(from, to, 'between parallel planes'), angle_rad };
}
