// Who draws: a GPU where there is one. A browser without one lets the processor pretend (SwiftShader, llvmpipe), which is far slower than
// what software_picture.ts does, or has no WebGL at all. ?renderer=webgl or ?renderer=software in the page's address decides otherwise.
import {GpuPicture, rendererOf} from './gpu_picture';
import type {Picture} from './scene';
import {SoftwarePicture} from './software_picture';

export function makePicture(): Picture {
  const asked = new URLSearchParams(location.search).get('renderer');
  return asked === 'webgl' || asked !== 'software' && hasGpu() ? new GpuPicture() : new SoftwarePicture();
}

function hasGpu(): boolean {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return false;
  const name = rendererOf(gl);
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return !/SwiftShader|llvmpipe|softpipe|Basic Render/i.test(name);
}
