// A fragment shader that runs once for each texel of a target.
import {
  BufferAttribute, BufferGeometry, FloatType, GLSL3, Mesh, NearestFilter, NoBlending, OrthographicCamera, RawShaderMaterial, RGBAFormat, Scene, Sphere,
  WebGLRenderTarget, type IUniform, type WebGLRenderer,
} from 'three';
import type {Grid} from './layout';

export type Uniforms = Record<string, IUniform>;

const vertex = `in vec2 position; void main() { gl_Position = vec4(position, 0.0, 1.0); }`;

export class Pass {
  readonly target: WebGLRenderTarget;
  readonly material: RawShaderMaterial;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera();
  private readonly geometry = new BufferGeometry();

  /** `outputs` pictures of floats, written by the fragment shader. */
  constructor(grid: Grid, outputs: number, fragment: string, uniforms: Uniforms) {
    this.target = new WebGLRenderTarget(grid.width, grid.height, {
      count: outputs, type: FloatType, format: RGBAFormat, depthBuffer: false, minFilter: NearestFilter, magFilter: NearestFilter,
    });
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: vertex, fragmentShader: fragment, uniforms, depthTest: false, depthWrite: false, blending: NoBlending,
    });
    this.geometry.setAttribute('position', new BufferAttribute(new Float32Array([-1, -1, 3, -1, -1, 3]), 2));
    this.geometry.boundingSphere = new Sphere();
    const triangle = new Mesh(this.geometry, this.material);
    triangle.frustumCulled = false;
    this.scene.add(triangle);
  }

  run(renderer: WebGLRenderer): void {
    renderer.setRenderTarget(this.target);
    renderer.render(this.scene, this.camera);
    renderer.setRenderTarget(null);
  }

  dispose(): void {
    this.target.dispose();
    this.material.dispose();
    this.geometry.dispose();
  }
}
