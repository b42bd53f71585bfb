// Pipes as tubes.
import {
  Color,
  CylinderGeometry,
  Float32BufferAttribute,
  Group,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from 'three';

const NUMBERS = 9; // of a pipe, see ../../web/page_writer.cc
const SIDES = 24;
const UP = new Vector3(0, 1, 0); // the axis of a CylinderGeometry
const LIGHT = new Vector3(0.8, 0.3, 0.5).normalize();

// Brightness by where a side looks, so that a tube looks round.
function shade(geometry, turn) {
  const { normal } = geometry.attributes;
  const colours = [];
  for (let i = 0; i < normal.count; i++) {
    const n = new Vector3().fromBufferAttribute(normal, i).applyQuaternion(turn);
    const value = 0.72 + 0.28 * n.dot(LIGHT);
    colours.push(value, value, value);
  }
  return colours;
}

export class PipeLayer {
  constructor({ arrays }) {
    this.count = arrays.pipes.length / NUMBERS;
    this.material = new MeshBasicMaterial({ vertexColors: true });
    this.object = new Group();
    for (let i = 0; i < this.count; i++) {
      this.object.add(this.tube(arrays.pipes.subarray(i * NUMBERS, (i + 1) * NUMBERS)));
    }
  }

  tube(numbers) {
    const start = new Vector3(...numbers.subarray(0, 3));
    const end = new Vector3(...numbers.subarray(3, 6));
    const way = new Vector3().subVectors(end, start);
    const geometry = new CylinderGeometry(numbers[6], numbers[6], way.length(), SIDES);
    const turn = new Quaternion().setFromUnitVectors(UP, way.clone().normalize());
    geometry.setAttribute('color', new Float32BufferAttribute(shade(geometry, turn), 3));
    const mesh = new Mesh(geometry, this.material);
    mesh.quaternion.copy(turn);
    mesh.position.addVectors(start, end).multiplyScalar(0.5);
    return mesh;
  }

  setPalette(palette) {
    this.material.color = new Color(palette.pipe);
  }
}
