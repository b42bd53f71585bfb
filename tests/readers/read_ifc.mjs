// Reads an IFC file with web-ifc and prints what is in it, a row each:
//   node read_ifc.mjs FILE
//   schema NAME
//   count TYPE NUMBER                                        of all entities
//   product TYPE GUID TRIANGLES VOLUME LOW(3) HIGH(3)        of each that has a solid
// with volumes (m3) of the triangles that web-ifc makes, openings cut, and the box around them
// (metres, z up).
import { readFileSync } from 'node:fs';
import * as webIfc from 'web-ifc';

const api = new webIfc.IfcAPI();
await api.Init();
api.SetLogLevel(webIfc.LogLevel.LOG_LEVEL_ERROR);
const model = api.OpenModel(new Uint8Array(readFileSync(process.argv[2])));

const typeName = (id) => api.GetNameFromTypeCode(api.GetLineType(model, id));

function listOf(vector) {
  return Array.from({ length: vector.size() }, (_, i) => vector.get(i));
}

function countTypes() {
  const counts = new Map();
  for (const id of listOf(api.GetAllLines(model))) {
    counts.set(typeName(id), (counts.get(typeName(id)) ?? 0) + 1);
  }
  return counts;
}

// `matrix` is 4x4, column-major; web-ifc turns z up into y up, which is undone here.
function toWorld(matrix, x, y, z) {
  const row = (i) => matrix[i] * x + matrix[4 + i] * y + matrix[8 + i] * z + matrix[12 + i];
  return [row(0), -row(2), row(1)];
}

// The corners of each triangle.
function trianglesOf(placed) {
  const geometry = api.GetGeometry(model, placed.geometryExpressID);
  const values = api.GetVertexArray(geometry.GetVertexData(), geometry.GetVertexDataSize());
  const indices = api.GetIndexArray(geometry.GetIndexData(), geometry.GetIndexDataSize());
  const corner = (i) => toWorld(placed.flatTransformation, ...values.slice(6 * i, 6 * i + 3));
  const triangles = [];
  for (let i = 0; i < indices.length; i += 3) {
    triangles.push([0, 1, 2].map((k) => corner(indices[i + k])));
  }
  return triangles;
}

function determinant(a, b, c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// About the first corner, for the sake of precision.
function volumeOf(triangles) {
  const origin = triangles[0][0];
  const moved = (p) => p.map((value, k) => value - origin[k]);
  return triangles.reduce((sum, t) => sum + determinant(...t.map(moved)) / 6, 0);
}

function printProduct(id) {
  const mesh = api.GetFlatMesh(model, id);
  const triangles = listOf(mesh.geometries).flatMap(trianglesOf);
  if (triangles.length === 0) return;
  const points = triangles.flat();
  const extreme = (choose) => [0, 1, 2].map((k) => points.reduce((m, p) => choose(m, p[k]), points[0][k]));
  const numbers = [volumeOf(triangles), ...extreme(Math.min), ...extreme(Math.max)];
  console.log(['product', typeName(id), api.GetLine(model, id).GlobalId.value, triangles.length,
               ...numbers.map((n) => n.toFixed(6))].join(' '));
}

console.log(`schema ${api.GetModelSchema(model)}`);
for (const [name, count] of countTypes()) console.log(`count ${name.toUpperCase()} ${count}`);
for (const type of [webIfc.IFCWALL, webIfc.IFCSLAB, webIfc.IFCSPACE, webIfc.IFCBUILDINGELEMENTPROXY,
  webIfc.IFCPIPESEGMENT]) {
  listOf(api.GetLineIDsWithType(model, type)).forEach(printProduct);
}
