// Reads an E57 file with web-e57 and prints what is in it, a row each:
//   node read_e57.mjs FILE
//   scan POINTS                     of each
//   point X Y Z RED GREEN BLUE      of each of all scans, in the frame of the file; colours where it
//                                   has any
//   xml TEXT                        without line breaks
// It checks the pages' checksums.
import { readFileSync } from 'node:fs';
// By its parts: node imports no WebAssembly by itself.
import * as reader from './node_modules/web-e57/e57_bg.js';

const folder = new URL('./node_modules/web-e57/', import.meta.url);
const wasm = await WebAssembly.instantiate(
  readFileSync(new URL('e57_bg.wasm', folder)), { './e57_bg.js': reader });
reader.__wbg_set_wasm(wasm.instance.exports);

const bytes = new Uint8Array(readFileSync(process.argv[2]));
for (const scan of JSON.parse(reader.convertE57(bytes, 'JSON'))) console.log(`scan ${scan.length}`);
for (const row of reader.convertE57(bytes, 'XYZ').trim().split('\n')) console.log(`point ${row}`);
console.log(`xml ${reader.convertE57(bytes, 'XML').replaceAll('\n', '')}`);
