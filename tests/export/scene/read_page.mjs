// Prints the walls of a map's page as the page's own plan draws them, in the map's world:
//   node read_page.mjs PAGE_TEXT     // the part of the page that holds the map
// {"walls": [{"id", "face": [start, end], "parts": [outline...], "openings": [[stroke ends]...]}]}
import { readFileSync } from 'node:fs';
import { inflateSync } from 'node:zlib';
import { openingStrokes, wallOutlines } from '../../../export/page/src/plan.js';

const block = inflateSync(Buffer.from(readFileSync(process.argv[2], 'utf8'), 'base64'));
const { building, origin } = JSON.parse(block.toString('utf8', 4, 4 + block.readUInt32LE(0)));
const inWorld = ({ x, y }) => [x + origin[0], y + origin[1]];
const walls = building.walls.map((wall) => ({
  id: wall.id,
  face: [wall.start, wall.end].map(([x, y]) => inWorld({ x, y })),
  parts: wallOutlines(wall).map((outline) => outline.map(inWorld)),
  openings: wall.openings.map((opening) => openingStrokes(wall, opening).map(inWorld)),
}));
console.log(JSON.stringify({ walls }));
