// Distances between points, lines and planes.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Vector3 } from 'three';
import { distanceBetween } from '../../../export/page/src/distance.js';

const point = (...at) => ({ type: 'point', at: new Vector3(...at), sigma_m: 0.003 });
const line = (a, b) => ({
  type: 'line',
  a: new Vector3(...a),
  b: new Vector3(...b),
  sigma_m: 0.004,
});
const plane = (normal, offset_m, centre) => ({
  type: 'plane',
  normal: new Vector3(...normal).normalize(),
  offset_m,
  centre: new Vector3(...centre),
  sigma_m: 0.012,
});

function expectDistance(result, expected_m) {
  assert.ok(Math.abs(result.distance_m - expected_m) < 1e-9, `${result.distance_m}`);
  assert.ok(Math.abs(result.from.distanceTo(result.to) - expected_m) < 1e-9);
}

test('between points, with the sigma of both', () => {
  const result = distanceBetween(point(1, 2, 3), point(4, 6, 3));
  expectDistance(result, 5);
  assert.ok(Math.abs(result.sigma_m - 0.003 * Math.SQRT2) < 1e-12);
});

test('from a point to the line of which a part was seen, in either order', () => {
  const edge = line([0, 0, 0], [1, 0, 0]);
  expectDistance(distanceBetween(point(5, 3, 4), edge), 5);
  const result = distanceBetween(edge, point(5, 3, 4));
  expectDistance(result, 5);
  assert.ok(Math.abs(result.sigma_m - 0.005) < 1e-12);
});

test('from a point to a plane', () => {
  expectDistance(distanceBetween(plane([0, 0, 2], 1, [0, 0, 1]), point(7, 8, 3.5)), 2.5);
});

test('between parallel lines where they lie side by side, whichever way they go', () => {
  const result = distanceBetween(line([0, 0, 0], [4, 0, 0]), line([6, 3, 0], [2, 3, 0]));
  expectDistance(result, 3);
  assert.ok(Math.abs(result.from.x - 3) < 1e-9);
  assert.equal(result.angle_rad, 0);
});

test('between lines that cross in space: the shortest, as far as they were seen', () => {
  expectDistance(distanceBetween(line([-1, 0, 0], [1, 0, 0]), line([0, -1, 2], [0, 1, 2])), 2);
  expectDistance(distanceBetween(line([-1, 0, 0], [1, 0, 0]), line([4, -1, 4], [4, 1, 4])), 5);
});

test('from a line to a plane: parallel ones, and the nearer end of others', () => {
  const floor = plane([0, 0, 1], 0, [0, 0, 0]);
  expectDistance(distanceBetween(line([0, 0, 2], [3, 0, 2]), floor), 2);
  const post = distanceBetween(line([0, 0, 2], [0, 0, 1]), floor);
  expectDistance(post, 1);
  assert.ok(Math.abs(post.angle_rad - Math.PI / 2) < 1e-9);
});

test('between planes: opposite walls, and the angle only of those that meet', () => {
  const wall = plane([1, 0, 0], -1, [-1, 0, 1]);
  expectDistance(distanceBetween(wall, plane([-1, 0, 0], -2, [2, 1, 1])), 3);
  const corner = distanceBetween(wall, plane([1, 1, 0], 0, [0, 0, 0]));
  assert.equal(corner.distance_m, undefined);
  assert.ok(Math.abs(corner.angle_rad - Math.PI / 4) < 1e-9);
});

test('between planes that are almost parallel: in the middle between them', () => {
  const tilt = 0.01;
  const tilted = plane([-Math.cos(tilt), Math.sin(tilt), 0], -2 * Math.cos(tilt), [2, 0, 0]);
  const { distance_m } = distanceBetween(plane([1, 0, 0], 0, [0, 0, 0]), tilted);
  assert.ok(Math.abs(distance_m - 2) < 2e-4, `${distance_m}`);
});
