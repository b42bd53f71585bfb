// Occupied space as cubes.
import {
  BoxGeometry,
  BufferAttribute,
  Color,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  MeshBasicMaterial,
} from 'three';

// Shades of the faces of a BoxGeometry: x, -x, y, -y, z, -z; four corners each.
const SHADES = [0.88, 0.88, 0.76, 0.76, 1, 0.6];

export class VoxelLayer {
  constructor({ arrays }) {
    this.count = arrays.voxel_sizes.length;
    const box = new BoxGeometry(1, 1, 1);
    const geometry = new InstancedBufferGeometry();
    geometry.setIndex(box.index);
    geometry.setAttribute('position', box.attributes.position);
    const shades = SHADES.flatMap((shade) => new Array(4 * 3).fill(shade));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(shades), 3));
    geometry.setAttribute('centre', new InstancedBufferAttribute(arrays.voxel_centres, 3));
    geometry.setAttribute('size', new InstancedBufferAttribute(arrays.voxel_sizes, 1));
    geometry.instanceCount = this.count;
    this.material = new MeshBasicMaterial({ vertexColors: true });
    this.material.onBeforeCompile = (shader) => {
      shader.vertexShader =
        `attribute vec3 centre; attribute float size;\n${shader.vertexShader}`.replace(
          '#include <begin_vertex>',
          'vec3 transformed = centre + size * position;',
        );
    };
    this.object = new Mesh(geometry, this.material);
    this.object.frustumCulled = false;
    this.object.visible = false;
  }

  setPalette(palette) {
    this.material.color = new Color(palette.voxel);
  }
}
