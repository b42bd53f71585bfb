// Bundles scripts, styles and licences into HTML files with a mark where the map, or the list of
// tilesets, goes: page.html and tiles.html.
//
//   node bundle.mjs NODE_MODULES FOLDER
import { readFileSync, writeFileSync, readdirSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const [modules, folder] = process.argv.slice(2).map((path) => resolve(path));
const source = join(dirname(fileURLToPath(import.meta.url)), 'src');
const { buildSync } = createRequire(join(modules, 'index.js'))('esbuild');

function bundle(entry) {
  return buildSync({
    absWorkingDir: source,
    entryPoints: [join(source, entry)],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: ['chrome103', 'firefox113', 'safari16.4'], // the first with DecompressionStream
    legalComments: 'none', // whole licences are added below
    charset: 'utf8',
    nodePaths: [modules],
    metafile: true,
  });
}

// The packages that went into a bundle, from the paths of its inputs.
function packagesIn(metafile) {
  const names = Object.keys(metafile.inputs)
    .map((path) => path.match(/node_modules\/((?:@[^/]+\/)?[^/]+)\//)?.[1])
    .filter((name) => name);
  return [...new Set(names)].sort();
}

function licenceOf(name) {
  const folder = join(modules, name);
  const { version } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const file = readdirSync(folder).find((entry) => /^licen[cs]e(\.|$)/i.test(entry));
  if (!file) throw new Error(`${folder}: found no licence, expected a file of that name`);
  return `${name} ${version}\n\n${readFileSync(join(folder, file), 'utf8').trim()}`;
}

function makePage(frame, entry) {
  const script = bundle(entry);
  // In an inline script, "</script" would end it.
  const text = script.outputFiles[0].text.replaceAll('</script', '<\\/script');
  const licences = packagesIn(script.metafile).map(licenceOf).join('\n\n');
  const parts = {
    '@LICENCES@': licences.replaceAll('--', '- -'),
    '@STYLES@': bundle('styles.css').outputFiles[0].text,
    '@SCRIPT@': text,
  };
  let page = readFileSync(join(source, frame), 'utf8');
  for (const [mark, part] of Object.entries(parts)) {
    if (page.split(mark).length !== 2) throw new Error(`${frame}: expected ${mark} once`);
    page = page.replace(mark, () => part);
  }
  return page;
}

const pages = {
  'page.html': makePage('index.html', 'main.js'),
  'tiles.html': makePage('tiles.html', 'tiles_main.js'),
};
for (const [name, page] of Object.entries(pages)) writeFileSync(join(folder, name), page);
