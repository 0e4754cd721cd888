// One source file of the page as a module, for what is tested without a browser.
import {build} from 'esbuild';

export async function load(path) {
  const {outputFiles: [{text}]} = await build({
    entryPoints: [new URL('../../src/' + path, import.meta.url).pathname], bundle: true, write: false, format: 'esm', target: 'es2022', logLevel: 'warning',
  });
  return import('data:text/javascript;base64,' + Buffer.from(text).toString('base64'));
}
