// The picture's place in the page: who draws it, the camera, and what is drawn of a model. It draws when something has changed, and not otherwise.
import {PerspectiveCamera, Vector3} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import type {Model} from '../data/model';
import {makePicture} from '../draw/choose';
import type {Picture} from '../draw/scene';
import type {Side} from '../shape/positions';
import {rgb} from './colours';
import {boundsOf, toPixels} from './geometry';
import {ModelView} from './model_view';

export class Viewport {
  readonly canvas: HTMLCanvasElement;
  readonly camera = new PerspectiveCamera(32, 1, 0.01, 100);
  readonly controls: OrbitControls;
  readonly picture: Picture;
  view: ModelView | null = null;
  private pending = 0;
  private inset = 0;  // pixels at the top that the toolbar covers
  private centre = new Vector3();
  private radius = 1;

  constructor(private readonly parent: HTMLElement) {
    this.picture = makePicture();
    this.canvas = this.picture.canvas;
    for (const restored of ['webglcontextrestored', 'contextrestored']) this.canvas.addEventListener(restored, () => this.invalidate());
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'The character. Drag to turn, Shift and arrow keys turn, plus and minus zoom, F fits.');
    parent.append(this.canvas);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.invalidate());
    new ResizeObserver(() => requestAnimationFrame(() => this.resize())).observe(parent);
  }

  setModel(model: Model): ModelView {
    this.view = new ModelView(model, () => this.invalidate());
    this.picture.show(this.view);
    this.resize();
    return this.view;
  }

  /** #rrggbb. */
  setBackground(colour: string): void {
    this.picture.setBackground(rgb(colour));
    this.invalidate();
  }

  /** Keeps the middle of the picture below what covers its top. */
  setInset(pixels: number): void {
    this.inset = pixels;
    this.resize();
  }

  private resize(): void {
    const {clientWidth: width, clientHeight: height} = this.parent, ratio = Math.min(2, devicePixelRatio);
    if (!width || !height) return;
    this.picture.resize(width, height, ratio);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, -this.inset / 2, width, height);
    this.invalidate();
  }

  /** Puts all points into the picture, seen from `direction` or as they are seen now. */
  fit(direction?: Vector3): void {
    if (!this.view) return;
    const box = boundsOf(this.view.shownPoints());
    box.getCenter(this.centre);
    this.radius = Math.max(1e-4, box.getSize(new Vector3()).length() / 2);
    const towards = direction ?? this.camera.position.clone().sub(this.controls.target);
    if (towards.lengthSq() < 1e-12) towards.set(0, 0, 1);
    const {clientWidth: width, clientHeight: height} = this.parent;
    const half = Math.tan(this.camera.fov * Math.PI / 360) * Math.min(Math.max(0.3, 1 - this.inset / Math.max(1, height)), width / Math.max(1, height) || 1);
    this.controls.target.copy(this.centre);
    this.camera.position.copy(this.centre).addScaledVector(towards.normalize(), this.radius / Math.sin(Math.atan(half)) * 0.98);
    this.camera.near = this.radius / 100;
    this.camera.far = this.radius * 100;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.invalidate();
  }

  /** Turns about the target, in radians. */
  turn(across: number, up: number): void {
    const from = this.camera.position.clone().sub(this.controls.target);
    const length = from.length();
    const polar = Math.min(Math.PI - 0.01, Math.max(0.01, Math.acos(from.y / length) - up));
    const azimuth = Math.atan2(from.x, from.z) + across;
    from.set(Math.sin(polar) * Math.sin(azimuth), Math.cos(polar), Math.sin(polar) * Math.cos(azimuth)).multiplyScalar(length);
    this.camera.position.copy(this.controls.target).add(from);
    this.controls.update();
    this.invalidate();
  }

  zoom(factor: number): void {
    const from = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(from);
    this.controls.update();
    this.invalidate();
  }

  points(side: Side): Float32Array {
    return this.view ? this.view.positions.of(side) : new Float32Array();
  }

  pixelsOf(points: Float32Array, vertex: number): {x: number; y: number} {
    const place = new Vector3().fromArray(points, 3 * vertex);
    return toPixels(place, this.camera, this.canvas.clientWidth, this.canvas.clientHeight) ?? {x: NaN, y: NaN};
  }

  invalidate(): void {
    if (!this.pending) this.pending = requestAnimationFrame(() => this.draw());
  }

  draw(): void {
    cancelAnimationFrame(this.pending);
    this.pending = 0;
    this.view?.update();
    this.picture.draw(this.camera);
  }
}
