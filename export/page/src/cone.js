// What is within some pixels of the pointer: a cone from the eye, or with parallel rays a cylinder.
import { Vector3 } from 'three';

const offset = new Vector3();
const centre = new Vector3();

export class Cone {
  // The radius is base_m + slope times the distance along the ray.
  constructor(ray, base_m, slope) {
    this.ray = ray;
    this.base_m = base_m;
    this.slope = slope;
  }

  radius(depth_m) {
    return this.base_m + this.slope * depth_m;
  }

  holds(point) {
    return this.meets(point, 0);
  }

  meetsSphere({ center, radius }) {
    return this.meets(center, radius);
  }

  // Of a box, its sphere is looked at: some boxes beside the cone count too.
  meetsBox(box) {
    box.getCenter(centre);
    return this.meets(centre, 0.5 * box.getSize(offset).length());
  }

  meets(point, radius_m) {
    const depth_m = offset.subVectors(point, this.ray.origin).dot(this.ray.direction);
    if (depth_m < -radius_m) return false;
    const aside_sq = Math.max(offset.lengthSq() - depth_m * depth_m, 0);
    return aside_sq <= (this.radius(Math.max(depth_m + radius_m, 0)) + radius_m) ** 2;
  }
}
