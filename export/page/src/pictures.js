// Pictures of keyframes: where they were taken, and the one that is shown, as a pyramid with it.
import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  SRGBColorSpace,
  Texture,
  Vector3,
} from 'three';

const PLACE_M = 0.12; // from a camera to its image, of those that are not shown
const SHOWN_M = 0.7;

// The image's corners of a camera, from the top left one clockwise, in the world.
function cornersAt({ centre, rotation }, corners, depth_m) {
  return corners.map((corner) =>
    new Vector3(...corner).multiplyScalar(depth_m).applyQuaternion(rotation).add(centre),
  );
}

export function pyramidEnds(pose, corners, depth_m) {
  const seen = cornersAt(pose, corners, depth_m);
  return seen.flatMap((corner, k) => [
    ...pose.centre,
    ...corner,
    ...corner,
    ...seen[(k + 1) % seen.length],
  ]);
}

export function poseAt(poses, keyframe) {
  return {
    centre: new Vector3().fromArray(poses, 7 * keyframe),
    rotation: new Quaternion().fromArray(poses, 7 * keyframe + 3),
  };
}

function pyramids(ends) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(ends), 3));
  return new LineSegments(geometry, new LineBasicMaterial());
}

export class Pictures {
  constructor({ document, arrays }) {
    this.arrays = arrays;
    this.corners = document.camera_corners;
    this.count = arrays.image_keyframe.length;
    this.poses = Array.from(arrays.image_keyframe, (keyframe) =>
      poseAt(arrays.keyframe_poses, keyframe),
    );
    this.places = pyramids(
      this.poses.flatMap((pose) => pyramidEnds(pose, this.corners, PLACE_M)),
    );
    this.shown = pyramids([]);
    this.screen = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ side: DoubleSide }));
    this.screen.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const texels = new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]); // the image's first row is its top
    this.screen.geometry.setAttribute('uv', new BufferAttribute(texels, 2));
    this.object = new Group();
    this.object.add(this.places, this.shown, this.screen);
    this.hide();
  }

  setPalette(palette) {
    this.places.material.color.set(palette.keyframe);
    this.shown.material.color.set(palette.highlight);
  }

  // Calls visit(index, position) for each that is in the cone.
  visitNear(cone, visit) {
    this.poses.forEach(({ centre }, index) => {
      if (cone.holds(centre)) visit(index, centre);
    });
  }

  keyframeOf(index) {
    return this.arrays.image_keyframe[index];
  }

  time_s(index) {
    return this.arrays.keyframe_times[this.keyframeOf(index)];
  }

  // The promise of a picture as an ImageBitmap; of the last one asked for it is kept.
  read(index) {
    if (this.readIndex === index) return this.reading;
    const { image_bytes, image_end } = this.arrays;
    const bytes = image_bytes.subarray(index > 0 ? image_end[index - 1] : 0, image_end[index]);
    this.readIndex = index;
    this.reading = createImageBitmap(new Blob([bytes], { type: 'image/jpeg' }));
    return this.reading;
  }

  // Resolves when it is ready to be drawn, unless another was to be shown meanwhile.
  async show(index) {
    if (this.shownIndex === index || this.corners.length === 0) return;
    this.shownIndex = index;
    const bitmap = await this.read(index);
    if (this.shownIndex !== index) return;
    const corners = cornersAt(this.poses[index], this.corners, SHOWN_M);
    const positions = new Float32Array(corners.flatMap((corner) => [...corner]));
    this.screen.geometry.setAttribute('position', new BufferAttribute(positions, 3));
    this.screen.geometry.computeBoundingSphere();
    this.screen.material.map?.dispose();
    const texture = new Texture(bitmap);
    Object.assign(texture, { flipY: false, colorSpace: SRGBColorSpace, needsUpdate: true });
    this.screen.material.map = texture;
    this.screen.material.needsUpdate = true;
    const ends = new Float32Array(pyramidEnds(this.poses[index], this.corners, SHOWN_M));
    this.shown.geometry.setAttribute('position', new BufferAttribute(ends, 3));
    this.shown.geometry.computeBoundingSphere();
    this.shown.visible = this.screen.visible = true;
  }

  hide() {
    this.shownIndex = null;
    this.shown.visible = this.screen.visible = false;
  }

  // An element that shows it.
  element(index) {
    const canvas = document.createElement('canvas');
    canvas.className = 'picture';
    this.read(index).then((bitmap) => {
      Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
      canvas.getContext('2d').drawImage(bitmap, 0, 0);
    });
    return canvas;
  }
}
