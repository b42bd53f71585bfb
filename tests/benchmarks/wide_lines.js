// 100,000 of three.js' wide lines as its example draws them, turning: what the page is held against.
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

const LINES = 100000;
const renderer = new WebGLRenderer({ canvas: document.querySelector('canvas'), antialias: true });
renderer.setSize(innerWidth, innerHeight);
const camera = new PerspectiveCamera(34, innerWidth / innerHeight, 0.1, 100);
camera.up.set(0, 0, 1);

// As in the map that it is compared with: short ones along three axes, in a room.
const ends = [];
const colours = [];
for (let i = 0; i < LINES; i++) {
  const start = [4 * Math.random(), 5 * Math.random(), 2.6 * Math.random()];
  const end = [...start];
  end[i % 3] += 0.1 + 0.4 * Math.random();
  ends.push(...start, ...end);
  const colour = [0, 1, 2].map((axis) => (axis === i % 3 ? 1 : 0.2));
  colours.push(...colour, ...colour);
}
const geometry = new LineSegmentsGeometry().setPositions(ends).setColors(colours);
const scene = new Scene();
scene.add(new LineSegments2(geometry, new LineMaterial({ linewidth: 2, vertexColors: true })));

// Draws from an angle about the room, as far away as the page sees it.
window.drawFrom = (angle_rad, distance_m) => {
  camera.position.set(
    2 + distance_m * 0.64 * Math.cos(angle_rad),
    2.5 + distance_m * 0.64 * Math.sin(angle_rad),
    1.3 + distance_m * 0.77,
  );
  camera.lookAt(2, 2.5, 1.3);
  renderer.render(scene, camera);
};
window.gl = renderer.getContext();
