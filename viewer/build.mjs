// Makes dist/viewer.html: the page with its script and style inside. The same bytes from the same sources.
import {build} from 'esbuild';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';

const here = new URL('.', import.meta.url);
const target = process.argv[2] ?? new URL('dist/viewer.html', here).pathname;

const licences = [
  'kpsa viewer, Apache License 2.0. Bundled:',
  'three.js, MIT License, Copyright 2010-2026 three.js authors, https://threejs.org/license',
  'uPlot, MIT License, Copyright (c) 2022 Leon Sorokin, https://github.com/leeoniya/uPlot',
  'Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated documentation files (the',
  '"Software"), to deal in the Software without restriction, including without limitation the rights to use, copy, modify, merge, publish,',
  'distribute, sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so, subject to',
  'the following conditions: The above copyright notice and this permission notice shall be included in all copies or substantial portions',
  'of the Software. THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE',
  'WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS',
  'BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN',
  'CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.',
];

// The page has shaders of its own: those of three.js (a seventh of it) stay out.
const lean = {
  name: 'lean',
  setup(builder) {
    builder.onResolve({filter: /^three$/}, () => builder.resolve('three/src/Three.js', {kind: 'import-statement', resolveDir: here.pathname}));
    builder.onLoad({filter: /three\/src\/renderers\/shaders\/ShaderChunk\.js$/}, () => ({contents: 'export const ShaderChunk = {};'}));
  },
};

const common = {bundle: true, minify: true, write: false, legalComments: 'none', charset: 'utf8', logLevel: 'warning'};
const [script, style] = await Promise.all([
  build({...common, plugins: [lean], entryPoints: [new URL('src/main.ts', here).pathname], format: 'iife', target: 'es2022', absWorkingDir: here.pathname}),
  build({...common, entryPoints: [new URL('src/style/all.css', here).pathname]}),
]);
const js = script.outputFiles[0].text.replaceAll('</script', '<\\/script').trim();
const css = style.outputFiles[0].text.trim();
const page = readFileSync(new URL('src/page.html', here), 'utf8')
  .replace('/*licences*/', () => '/*!\n' + licences.join('\n') + '\n*/')
  .replace('/*style*/', () => css)
  .replace('/*script*/', () => js);
if (page.split('<!--kpsa:data-->').length !== 2) throw new Error('the placeholder must be there once');
mkdirSync(new URL('dist/', here), {recursive: true});
writeFileSync(target, page);
console.log(`${target}: ${page.length} characters, ${Buffer.byteLength(page)} bytes`);
