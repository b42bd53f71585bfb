// Validates a GLB file with Khronos' validator:
//   node validate_gltf.mjs FILE
// prints what it finds, and fails where that is an error or a warning.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

const report = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])));
const { numErrors, numWarnings, numInfos, messages } = report.issues;
for (const { code, message, pointer } of messages) console.log(`${code} ${pointer}: ${message}`);
console.log(`${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos`);
process.exitCode = numErrors + numWarnings > 0 ? 1 : 0;
