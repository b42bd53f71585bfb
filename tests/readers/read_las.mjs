// Reads a LAS file with copc, and one of version 1.2 with loaders.gl too, and prints what is in it, a
// row each:
//   node read_las.mjs FILE
//   file VERSION FORMAT POINTS LOW(3) HIGH(3)
//   record USER ID BYTES                                        of each, before the points
//   point X Y Z GREY RED GREEN BLUE CLASS SYNTHETIC SOURCE NORMAL(3) SIGMA      of each
// Fails where the two do not find the same places, intensities and classes.
import { readFileSync } from 'node:fs';
import { Las } from 'copc';
import { parse } from '@loaders.gl/core';
import { LASLoader } from '@loaders.gl/las';

const bytes = new Uint8Array(readFileSync(process.argv[2]));
const get = async (from, to) => bytes.slice(from, to);
const header = Las.Header.parse(bytes.slice(0, 375));
const records = await Las.Vlr.walk(get, header);
const extra = records.find((r) => r.userId === 'LASF_Spec' && r.recordId === 4);
const view = Las.View.create(
  bytes.slice(header.pointDataOffset), header,
  Las.ExtraBytes.parse(await Las.Vlr.fetch(get, extra)));

const NAMES = ['X', 'Y', 'Z', 'Intensity', 'Red', 'Green', 'Blue', 'Classification', 'Synthetic',
  'PointSourceId', 'NormalX', 'NormalY', 'NormalZ', 'sigma'];
const getters = NAMES.map((name) => view.getter(name));
console.log(['file', `${header.majorVersion}.${header.minorVersion}`, header.pointDataRecordFormat,
             header.pointCount, ...header.min, ...header.max].join(' '));
for (const r of records) console.log(`record ${r.userId} ${r.recordId} ${r.contentLength}`);
for (let i = 0; i < header.pointCount; ++i) {
  console.log(['point', ...getters.map((value) => value(i))].join(' '));
}

async function compare() {
  const other = await parse(bytes.buffer, LASLoader, { las: { fp64: true, skip: 1 }, worker: false });
  const { POSITION, intensity, classification } = other.attributes;
  if (intensity.value.length !== header.pointCount) throw new Error('another number of points');
  for (let i = 0; i < header.pointCount; ++i) {
    for (let k = 0; k < 3; ++k) {
      if (Math.abs(POSITION.value[3 * i + k] - getters[k](i)) > 1e-6) throw new Error(`point ${i}`);
    }
    const flags = view.getter('Synthetic')(i) << 5;
    if (intensity.value[i] !== getters[3](i)) throw new Error(`intensity of point ${i}`);
    if ((classification.value[i] & ~flags) !== getters[7](i)) throw new Error(`class of point ${i}`);
  }
}
if (header.minorVersion === 2) await compare();
