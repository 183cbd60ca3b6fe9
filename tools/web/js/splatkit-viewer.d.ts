// Types of splatkit-viewer.js. docs/browser.md describes the element.

/** A camera, as in scene files. Lengths are in world units, angles in degrees. */
export interface Camera {
  position: [number, number, number];
  focal_point: [number, number, number];
  view_up: [number, number, number];
  /** Of a view in perspective. */
  view_angle?: number;
  /** Of a parallel view: what its height shows. */
  height?: number;
}

/** A scene, as in scene files. */
export interface Scene {
  splatkit_scene: number;
  inputs: ({ file: string } & Record<string, unknown>)[];
  [part: string]: unknown;
}

/** A transfer function or a clip, as in scene files. */
export type Part = Record<string, unknown>;

export type Side = "" | "front" | "back" | "left" | "right" | "top" | "bottom" | "iso";

/** What draws. */
export interface Engine {
  engine: "webgpu" | "cpu";
  /** Why WebGPU does not draw; empty if it does. */
  reason: string;
}

/** The details of the element's events. */
export interface SplatkitViewerEventMap {
  load: CustomEvent<{ summary: string; warnings: string[] } & Engine>;
  frame: CustomEvent<{ width: number; height: number; isExact: boolean; milliseconds: number; workers: number } & Engine>;
  rest: CustomEvent<Record<string, never>>;
  camerachange: CustomEvent<{ camera: Camera }>;
  measure: CustomEvent<{ points: [number, number, number][]; length: number }>;
  fetched: CustomEvent<{ requests: number; bytes: number; cancelled: number; isBusy: boolean }>;
  error: CustomEvent<{ message: string; isFatal: boolean }>;
}

/** Where the worker and the engine are. */
export const resources: {
  worker(): Worker | Promise<Worker>;
  wasm(hear: (bytes: number, all: number) => void): Promise<ArrayBuffer>;
};

/** The element `<splatkit-viewer>`. */
export class SplatkitViewer extends HTMLElement {
  /** The address of a scene file, or of a file of data. */
  src: string;
  /** The camera; null before a scene is shown. */
  get camera(): Camera | null;
  set camera(camera: Camera);
  /** The transfer functions of the fields, as they were loaded. */
  readonly transfers: Part[];
  /** Whether the exact picture is shown. */
  readonly isExact: boolean;
  /** Texts at points of the world. */
  annotations: { point: [number, number, number]; text: string }[];
  /** Begins to measure between two clicks, or ends it. */
  measure(isMeasuring?: boolean): void;
  /** The canvas, for programs that read its pixels. */
  readonly canvas: HTMLCanvasElement;
  setTransfer(transfer: Part, field?: number): void;
  setClips(clips: Part[]): void;
  /** Shows the whole scene, from a side or as at first. */
  fit(side?: Side): void;
  /** The point of the scene at a place of the page; null where there is none. */
  pointAt(clientX: number, clientY: number): Promise<[number, number, number] | null>;
  /** The picture as a file. */
  picture(type?: string): Promise<Blob | null>;
  /** Shows a scene. Hierarchies and bricks may be addresses: they are read in parts. */
  open(scene: Scene | string, files: Iterable<[string, ArrayBuffer | string | URL]>): Promise<void>;
  /** Says in the page what went wrong, and ends the worker. */
  complain(message: string): void;
  toggleFullscreen(): void;
  /** Ends the worker and gives its memory back. */
  close(): void;
  addEventListener<K extends keyof SplatkitViewerEventMap>(
    type: K,
    listener: (event: SplatkitViewerEventMap[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "splatkit-viewer": SplatkitViewer;
  }
}
