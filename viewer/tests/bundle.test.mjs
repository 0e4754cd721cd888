// The file that is shipped: small, whole, and what the sources make.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';

const root = new URL('../', import.meta.url), page = readFileSync(new URL('dist/viewer.html', root), 'utf8');

test('the page is below 700 kB', () => {
  assert.ok(Buffer.byteLength(page) < 700_000, `${Buffer.byteLength(page)} bytes`);
});

test('the placeholder is there once, alone on its line', () => {
  assert.equal(page.split('<!--kpsa:data-->').length, 2);
  assert.ok(page.split('\n').includes('<!--kpsa:data-->'));
});

test('nothing is loaded from elsewhere, and a policy says so', () => {
  assert.match(page, /Content-Security-Policy" content="default-src 'none';/);
  const markup = page.replace(/<script>[\s\S]*<\/script>/, '').replace(/<style>[\s\S]*<\/style>/, '');
  assert.doesNotMatch(markup, /(src|href)="?(https?:)?\/\//);
  assert.doesNotMatch(page.match(/<style>[\s\S]*<\/style>/)[0], /url\(|@import/);
});

test('the licences of what is inside are inside', () => {
  assert.match(page, /three\.js, MIT License/);
  assert.match(page, /uPlot, MIT License/);
  assert.match(page, /Permission is hereby granted/);
});

test('a rebuild gives the same bytes', () => {
  const folder = mkdtempSync(join(tmpdir(), 'kpsa-viewer-')), target = join(folder, 'viewer.html');
  try {
    execFileSync(process.execPath, [new URL('build.mjs', root).pathname, target], {cwd: tmpdir()});
    assert.ok(readFileSync(target, 'utf8') === page, 'dist/viewer.html is not what the sources make: npm run build');
  } finally {
    rmSync(folder, {recursive: true, force: true});
  }
});

test('no registry is named in the lock file, and versions are exact', () => {
  const lock = JSON.parse(readFileSync(new URL('package-lock.json', root), 'utf8'));
  assert.ok(Object.values(lock.packages).every((entry) => !('resolved' in entry)));
  const {dependencies, devDependencies} = JSON.parse(readFileSync(new URL('package.json', root), 'utf8'));
  for (const [name, version] of Object.entries({...dependencies, ...devDependencies})) assert.match(version, /^\d+\.\d+\.\d+$/, name);
});
