// Planes of the building, seen from the side from which they were measured only: from outside, one
// looks through walls and ceilings into the rooms.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  FrontSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Raycaster,
  ShapeUtils,
  Vector2,
  Vector3,
} from 'three';

const PLANE_KINDS = ['wall', 'floor', 'ceiling', 'other'];
const LIGHT = new Vector3(0.8, 0.3, 0.5).normalize();
const BEHIND_M = 0.08; // how far planes are drawn behind what is on them
const OPENING_KINDS = ['door', 'window', 'passage'];
const PANE = 0.28; // opacity of the areas of doors and windows

// Two directions in a plane that make a right-handed frame with its normal.
function frameOf(normal) {
  const up = Math.abs(normal.z) > 0.9 ? new Vector3(1, 0, 0) : new Vector3(0, 0, 1);
  const u = new Vector3().crossVectors(up, normal).normalize();
  return { u, v: new Vector3().crossVectors(normal, u) };
}

// Triangles of an outline without openings and holes, as points in space, counter-clockwise about the
// normal.
function trianglesOf({ outline, openings, holes }, normal) {
  const { u, v } = frameOf(normal);
  const flatten = (points, clockwise) => {
    const kept = points.map((p) => new Vector3(...p));
    const flat = kept.map((p) => new Vector2(p.dot(u), p.dot(v)));
    const turned = ShapeUtils.isClockWise(flat) !== clockwise;
    return turned ? { kept: kept.reverse(), flat: flat.reverse() } : { kept, flat };
  };
  const contour = flatten(outline, false);
  const cuts = [...openings.map((opening) => opening.outline), ...holes].map((ring) =>
    flatten(ring, true),
  );
  const points = [contour, ...cuts].flatMap(({ kept }) => kept);
  const faces = ShapeUtils.triangulateShape(
    contour.flat,
    cuts.map(({ flat }) => flat),
  );
  return faces.flatMap((face) => face.map((corner) => points[corner]));
}

function areaOf(triangles) {
  let area = 0;
  for (let i = 0; i + 2 < triangles.length; i += 3) {
    const [a, b, c] = triangles.slice(i, i + 3);
    area += 0.5 * b.clone().sub(a).cross(c.clone().sub(a)).length();
  }
  return area;
}

function outlineEdges(outline) {
  return outline.flatMap((point, i) => [...point, ...outline[(i + 1) % outline.length]]);
}

// Shifts what is drawn away from the camera, so that lines on planes are seen whole.
export function drawBehind(material, distance_m) {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(
      '#include <project_vertex>',
      `
      #include <project_vertex>
      vec3 seen = isPerspectiveMatrix(projectionMatrix) ? normalize(mvPosition.xyz) : vec3(0, 0, -1);
      gl_Position = projectionMatrix * vec4(mvPosition.xyz + ${distance_m.toFixed(3)} * seen, 1.0);`,
    );
  };
  return material;
}

function edgeObject(coordinates) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(coordinates), 3));
  return new LineSegments(geometry, drawBehind(new LineBasicMaterial(), 0.5 * BEHIND_M));
}

// Openings of a kind: their borders and, of doors and windows, their areas, which are looked through.
function openingObjects(planes, kind) {
  const positions = [];
  const edges = [];
  for (const plane of planes) {
    for (const { outline } of plane.openings.filter((opening) => opening.kind === kind)) {
      edges.push(...outlineEdges(outline));
      if (kind === 'passage') continue;
      const own = { outline, openings: [], holes: [] };
      for (const { x, y, z } of trianglesOf(own, plane.direction)) positions.push(x, y, z);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  const material = new MeshBasicMaterial({
    transparent: true,
    opacity: PANE,
    side: DoubleSide,
    depthWrite: false,
  });
  return { kind, edges: edgeObject(edges), panes: new Mesh(geometry, material) };
}

// All planes of a kind as one object.
class PlaneLayer {
  constructor(planes) {
    this.planes = planes;
    const positions = [];
    this.planeOfFace = [];
    for (const plane of planes) {
      const triangles = trianglesOf(plane, plane.direction);
      plane.area_m2 = areaOf(triangles);
      for (const point of triangles) positions.push(point.x, point.y, point.z);
      for (let i = 0; i < triangles.length; i += 3) this.planeOfFace.push(plane);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(positions.length), 3));
    const material = new MeshBasicMaterial({ vertexColors: true, side: FrontSide });
    this.mesh = new Mesh(geometry, drawBehind(material, BEHIND_M));
    this.edges = edgeObject(
      planes.flatMap(({ outline, holes }) => [outline, ...holes].flatMap(outlineEdges)),
    );
    this.openings = OPENING_KINDS.map((kind) => openingObjects(planes, kind));
    this.object = new Group();
    this.object.add(this.mesh, this.edges);
    for (const { edges, panes } of this.openings) this.object.add(edges, panes);
  }

  setPalette(palette) {
    const { color } = this.mesh.geometry.attributes;
    this.planeOfFace.forEach((plane, face) => {
      const light = 0.88 + 0.12 * plane.direction.dot(LIGHT);
      const { r, g, b } = new Color(palette.plane[plane.kind]).multiplyScalar(light);
      for (let corner = 0; corner < 3; corner++) color.setXYZ(3 * face + corner, r, g, b);
    });
    color.needsUpdate = true;
    this.edges.material.color.set(palette.planeEdge);
    for (const { kind, edges, panes } of this.openings) {
      edges.material.color.set(palette.opening[kind]);
      panes.material.color.set(palette.opening[kind]);
    }
  }
}

export class Planes {
  constructor(planes) {
    this.all = planes;
    for (const plane of planes) {
      plane.direction = new Vector3(...plane.normal);
      plane.centre = plane.outline
        .reduce((sum, point) => sum.add(new Vector3(...point)), new Vector3())
        .divideScalar(plane.outline.length);
    }
    this.layers = Object.fromEntries(
      PLANE_KINDS.map((kind) => [
        kind,
        new PlaneLayer(planes.filter((plane) => plane.kind === kind)),
      ]),
    );
    this.object = new Group();
    for (const layer of Object.values(this.layers)) this.object.add(layer.object);
    this.raycaster = new Raycaster();
  }

  count(kind) {
    return this.layers[kind].planes.length;
  }

  setPalette(palette) {
    for (const layer of Object.values(this.layers)) layer.setPalette(palette);
  }

  // The nearest plane that is shown along a ray, and where; holds(point) says whether the section
  // leaves it. Null where there is none.
  pick(ray, holds) {
    this.raycaster.ray.copy(ray);
    let best = null;
    for (const { object, mesh, planeOfFace } of Object.values(this.layers)) {
      if (!object.visible) continue;
      for (const { faceIndex, point, distance } of this.raycaster.intersectObject(mesh, false)) {
        if (!holds(point) || (best && best.distance_m <= distance)) continue;
        best = { plane: planeOfFace[faceIndex], point, distance_m: distance };
      }
    }
    return best;
  }
}
