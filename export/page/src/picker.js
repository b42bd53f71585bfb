// What is under the pointer.
import { Raycaster, Vector2, Vector3 } from 'three';
import { Cone } from './cone.js';

const REACH_PX = 6;
const END_PX = 8;
const HIDDEN_M = 0.12; // behind a plane that is shown
const FROM_POINTS = 1.5; // px: lines are preferred to points as near

const projected = new Vector3();
const onRay = new Vector3();
const onLine = new Vector3();
const start = new Vector3();
const end = new Vector3();

export class Picker {
  // `view` gives camera and size, `layers` what there is, `section` what it leaves.
  constructor(view, layers, section) {
    this.view = view;
    this.layers = layers;
    this.section = section;
    this.raycaster = new Raycaster();
  }

  coneAt(x_px, y_px) {
    const { width, height } = this.view.size;
    const { camera } = this.view;
    const place = new Vector2((2 * x_px) / width - 1, 1 - (2 * y_px) / height);
    this.raycaster.setFromCamera(place, camera);
    const ray = this.raycaster.ray;
    if (camera.isOrthographicCamera) return new Cone(ray, REACH_PX * this.view.metresPerPixel(), 0);
    const slope = (REACH_PX * 2 * Math.tan((camera.fov * Math.PI) / 360)) / height;
    return new Cone(ray, 0, slope / this.cosineAt(ray));
  }

  // Pixels away from the middle of the image see less along their ray.
  cosineAt(ray) {
    return ray.direction.dot(this.view.camera.getWorldDirection(projected));
  }

  // Returns what is nearest in pixels, as { type, point, distance_m } with the `index` of a 'line',
  // a 'landmark' or a point of the 'dense' cloud, with the `end` of a line that is near, or with the
  // `plane`, or with the `index` of a 'picture'; null where there is nothing. Of only 'points', lines
  // count by their ends, and planes not; of 'surfaces' and 'all', the dense cloud does not, and
  // pictures of 'all' only.
  pick(x_px, y_px, only = 'all') {
    const cone = this.coneAt(x_px, y_px);
    const plane = this.layers.planes.pick(cone.ray, (point) => this.section.holds(point));
    const far_m = plane ? plane.distance_m + HIDDEN_M : Infinity;
    const points = only === 'points';
    const line = this.nearestLine(cone, far_m);
    const candidates = [
      points && !line?.end ? null : line,
      this.nearestPoint(this.layers.landmarks, 'landmark', cone, far_m),
      points ? this.nearestPoint(this.layers.dense, 'dense', cone, far_m) : null,
      only === 'all' ? this.nearestPoint(this.layers.pictures, 'picture', cone, far_m) : null,
    ].filter((candidate) => candidate);
    candidates.sort((a, b) => a.aside_px - b.aside_px);
    if (candidates.length > 0) return candidates[0];
    return plane && !points ? { type: 'plane', ...plane } : null;
  }

  // Pixels between the pointer and a point that is so far from its ray, at a depth along it.
  pixels(cone, aside_m, depth_m) {
    return (REACH_PX * aside_m) / cone.radius(depth_m);
  }

  nearestLine(cone, far_m) {
    const { lines, lineIndex } = this.layers;
    let best = null;
    lineIndex.visitNear(cone, (index) => {
      if (!lines.shown[index]) return;
      start.fromArray(lines.data.ends, 6 * index);
      end.fromArray(lines.data.ends, 6 * index + 3);
      const aside_m = Math.sqrt(cone.ray.distanceSqToSegment(start, end, onRay, onLine));
      const distance_m = onRay.distanceTo(cone.ray.origin);
      const aside_px = this.pixels(cone, aside_m, distance_m);
      if (aside_px > REACH_PX || distance_m > far_m || !this.section.holds(onLine)) return;
      if (best && !isBetter(aside_px, distance_m, best)) return;
      best = { type: 'line', index, aside_px, distance_m, point: onLine.clone() };
    });
    return best && this.withEnd(best);
  }

  // Near an end of a line, that end is meant where points can be.
  withEnd(best) {
    const { ends } = this.layers.lines.data;
    for (const which of [0, 1]) {
      const point = new Vector3().fromArray(ends, 6 * best.index + 3 * which);
      const away_px = this.view.toPixels(point).distanceTo(this.view.toPixels(best.point));
      if (away_px < END_PX) return { ...best, end: point };
    }
    return best;
  }

  nearestPoint(cloud, type, cone, far_m) {
    if (!cloud.object.visible) return null;
    let best = null;
    cloud.visitNear(cone, (index, point) => {
      const distance_m = cone.ray.closestPointToPoint(point, onRay).distanceTo(cone.ray.origin);
      const aside_px = this.pixels(cone, onRay.distanceTo(point), distance_m) + FROM_POINTS;
      if (aside_px > REACH_PX || distance_m > far_m || !this.section.holds(point)) return;
      if (best && !isBetter(aside_px, distance_m, best)) return;
      best = { type, index, aside_px, distance_m, point: point.clone() };
    });
    return best;
  }
}

// Among what is as near to the pointer, what is nearer to the eye.
function isBetter(aside_px, distance_m, best) {
  const nearer = distance_m < best.distance_m;
  return aside_px < best.aside_px - 2 || (aside_px < best.aside_px + 2 && nearer);
}
