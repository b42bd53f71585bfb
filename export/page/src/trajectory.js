// The way of the body, and the keyframes as pyramids of the left camera.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Group,
  LineBasicMaterial,
  LineSegments,
  Vector3,
} from 'three';
import { poseAt, pyramidEnds } from './pictures.js';
import { WideLines } from './wide_lines.js';

const FRUSTUM_M = 0.15;
const SPACING_M = 0.5; // keyframes nearer to the last drawn one are left out
const WIDTH_PX = 2;

// The way, but for what lies in gaps.
function wayEnds(positions, times_s, gap_s) {
  const ends = [];
  for (let i = 1; i < times_s.length; i++) {
    if (times_s[i] - times_s[i - 1] > gap_s) continue;
    for (let j = 3 * (i - 1); j < 3 * (i + 1); j++) ends.push(positions[j]);
  }
  return ends;
}

function frustumEnds(poses, corners) {
  const ends = [];
  const last = new Vector3(Infinity, Infinity, Infinity);
  for (let i = 0; i < poses.length / 7; i++) {
    const pose = poseAt(poses, i);
    if (pose.centre.distanceTo(last) < SPACING_M) continue;
    last.copy(pose.centre);
    ends.push(...pyramidEnds(pose, corners, FRUSTUM_M));
  }
  return ends;
}

export class TrajectoryLayer {
  constructor({ document, arrays }) {
    this.keyframeCount = arrays.keyframe_times.length;
    this.wayEnds = wayEnds(
      arrays.trajectory_positions,
      arrays.trajectory_times,
      document.trajectory_gap_s,
    );
    this.length_m = lengthOf(this.wayEnds);
    this.wide = new WideLines(WIDTH_PX);
    this.way = this.wide.object;
    this.keyframes = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
    const frustums = new Float32Array(frustumEnds(arrays.keyframe_poses, document.camera_corners));
    this.keyframes.geometry.setAttribute('position', new BufferAttribute(frustums, 3));
    this.object = new Group();
    this.object.add(this.way, this.keyframes);
  }

  setPalette(palette) {
    this.wide.showAll(this.wayEnds, new Color(palette.trajectory).getHex());
    this.keyframes.material.color.set(palette.keyframe);
  }
}

function lengthOf(ends) {
  let length = 0;
  for (let i = 0; i < ends.length; i += 6) {
    length += Math.hypot(
      ends[i + 3] - ends[i],
      ends[i + 4] - ends[i + 1],
      ends[i + 5] - ends[i + 2],
    );
  }
  return length;
}
