// Runs Khronos's glTF validator over files: node validate.mjs MODULES_FOLDER FILE…; fails on any error or warning.
import fs from 'node:fs';
import path from 'node:path';
import { createRequire } from 'node:module';

const [modules, ...files] = process.argv.slice(2);
const validator = createRequire(path.resolve(modules, 'x.js'))('gltf-validator');
let failed = 0;
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { uri: path.basename(file) });
  const { numErrors, numWarnings, messages } = report.issues;
  console.log(`${path.basename(file)}: ${numErrors} errors, ${numWarnings} warnings`);
  if (numErrors + numWarnings > 0) {
    failed = 1;
    for (const m of messages.filter((m) => m.severity < 2).slice(0, 10)) console.log(`  ${m.code} ${m.pointer ?? ''}: ${m.message}`);
  }
}
process.exit(failed);
