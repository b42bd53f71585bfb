// Clouds of points: the dense one in chunks, and the fused landmarks.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Group,
  Points,
  ShaderMaterial,
  Sphere,
  Vector3,
} from 'three';
import { sigmaOfCode } from './pack.js';

const POINT_M = 0.02;
const BLOCK = 256; // points that are looked at together when one is searched

const VERTEX = `
  attribute vec4 look;  // grey, sigma's code, source
  uniform float size_m, scale_px;
  uniform vec2 greys;
  uniform vec3 colour;
  uniform float useGrey;
  varying vec3 vColour;
  varying float vSize;
  #include <clipping_planes_pars_vertex>
  void main() {
    vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    #include <clipping_planes_vertex>
    gl_Position = projectionMatrix * mvPosition;
    vSize = clamp(size_m * scale_px / gl_Position.w, 1.0, 12.0);
    gl_PointSize = vSize;
    vColour = mix(colour, vec3(mix(greys.x, greys.y, look.x)), useGrey);
  }`;

const FRAGMENT = `
  varying vec3 vColour;
  varying float vSize;
  #include <clipping_planes_pars_fragment>
  void main() {
    #include <clipping_planes_fragment>
    if (vSize > 3.0 && distance(gl_PointCoord, vec2(0.5)) > 0.5) discard;
    gl_FragColor = vec4(vColour, 1.0);
    #include <colorspace_fragment>
  }`;

function pointMaterial(useGrey, size_m) {
  return new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    clipping: true,
    uniforms: {
      size_m: { value: size_m },
      scale_px: { value: 1 },
      greys: { value: [0, 1] },
      colour: { value: new Color() },
      useGrey: { value: useGrey ? 1 : 0 },
    },
  });
}

// A stride that visits all of `count` places in an order whose every beginning is spread over them.
function spreadStride(count) {
  const gcd = (a, b) => (b === 0 ? a : gcd(b, a % b));
  let stride = Math.max(1, Math.round(count * 0.6180339887));
  while (gcd(stride, count) !== 1) stride++;
  return stride;
}

// Common to both clouds: spheres about blocks of points, and the search among them.
class Cloud {
  constructor(count) {
    this.count = count;
    this.object = new Group();
    this.blocks = [];
  }

  setScale(scale_px) {
    this.material.uniforms.scale_px.value = scale_px;
  }

  makeBlocks() {
    const point = new Vector3();
    for (let from = 0; from < this.count; from += BLOCK) {
      const to = Math.min(from + BLOCK, this.count);
      const points = [];
      for (let i = from; i < to; i++) points.push(this.positionOf(i, point).clone());
      this.blocks.push({ from, to, sphere: new Sphere().setFromPoints(points) });
    }
  }

  // Calls visit(index, position) for each point that is in the cone.
  visitNear(cone, visit) {
    if (this.blocks.length === 0) this.makeBlocks();
    const point = new Vector3();
    for (const { from, to, sphere } of this.blocks) {
      if (!cone.meetsSphere(sphere)) continue;
      for (let i = from; i < to; i++) {
        if (cone.holds(this.positionOf(i, point))) visit(i, point);
      }
    }
  }
}

export class DenseCloud extends Cloud {
  constructor({ document, arrays }) {
    super(arrays.dense_x.length);
    this.arrays = arrays;
    this.chunk_m = document.chunk_m;
    this.chunks = document.dense_chunks;
    this.material = pointMaterial(true, POINT_M);
  }

  // What is drawn is made when it first is.
  makeObjects() {
    if (this.object.children.length > 0) return;
    for (const chunk of this.chunks) this.object.add(this.chunkObject(chunk));
  }

  chunkObject({ corner, from, count }) {
    const { dense_x, dense_y, dense_z, dense_grey } = this.arrays;
    const steps = new Uint16Array(4 * count);
    const look = new Uint8Array(4 * count);
    const stride = spreadStride(count);
    for (let k = 0, i = from; k < count; k++, i = from + ((i - from + stride) % count)) {
      steps[4 * k] = dense_x[i];
      steps[4 * k + 1] = dense_y[i];
      steps[4 * k + 2] = dense_z[i];
      look[4 * k] = dense_grey[i];
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(steps, 4, true));
    geometry.setAttribute('look', new BufferAttribute(look, 4, true));
    geometry.boundingSphere = new Sphere(new Vector3(0.5, 0.5, 0.5), Math.sqrt(0.75));
    const points = new Points(geometry, this.material);
    points.position.fromArray(corner);
    points.scale.setScalar(this.chunk_m);
    return points;
  }

  // Draws only so many of the points, spread over all.
  useShare(share) {
    if (!this.object.visible) return;
    this.makeObjects();
    this.object.children.forEach((points, i) => {
      points.geometry.setDrawRange(0, Math.ceil(share * this.chunks[i].count));
    });
  }

  setPalette(palette) {
    this.material.uniforms.greys.value = palette.dense;
  }

  chunkOf(index) {
    return this.chunks.find(({ from, count }) => index < from + count);
  }

  makeBlocks() {
    for (const chunk of this.chunks) {
      const end = chunk.from + chunk.count;
      for (let from = chunk.from; from < end; from += BLOCK) {
        const to = Math.min(from + BLOCK, end);
        this.blocks.push({ from, to, sphere: this.sphereOf(chunk, from, to) });
      }
    }
  }

  // The sphere about the box of some points of a chunk.
  sphereOf({ corner }, from, to) {
    const half_step_m = (0.5 * this.chunk_m) / 65535;
    const centre = new Vector3();
    const extent = new Vector3();
    ['dense_x', 'dense_y', 'dense_z'].forEach((name, axis) => {
      const values = this.arrays[name];
      let low = 65535;
      let high = 0;
      for (let i = from; i < to; i++) {
        low = Math.min(low, values[i]);
        high = Math.max(high, values[i]);
      }
      centre.setComponent(axis, corner[axis] + half_step_m * (low + high));
      extent.setComponent(axis, half_step_m * (high - low));
    });
    return new Sphere(centre, extent.length());
  }

  positionOf(index, target) {
    const { corner } = this.chunkOf(index);
    const step_m = this.chunk_m / 65535;
    const { dense_x, dense_y, dense_z } = this.arrays;
    return target.set(
      corner[0] + step_m * dense_x[index],
      corner[1] + step_m * dense_y[index],
      corner[2] + step_m * dense_z[index],
    );
  }

  sigmaOf(index) {
    return sigmaOfCode(this.arrays.dense_sigma[index]);
  }

  isFilled(index) {
    return this.arrays.dense_source[index] === 1;
  }
}

export class Landmarks extends Cloud {
  constructor({ arrays }) {
    super(arrays.point_sigma.length);
    this.positions = arrays.point_positions;
    this.sigmas_m = arrays.point_sigma;
    this.observations = arrays.point_observations;
    this.material = pointMaterial(false, 2 * POINT_M);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.positions, 3));
    geometry.setAttribute('look', new BufferAttribute(new Uint8Array(4 * this.count), 4, true));
    this.object.add(new Points(geometry, this.material));
  }

  setPalette(palette) {
    this.material.uniforms.colour.value.set(palette.point);
  }

  positionOf(index, target) {
    return target.fromArray(this.positions, 3 * index);
  }

  sigmaOf(index) {
    return this.sigmas_m[index];
  }
}
