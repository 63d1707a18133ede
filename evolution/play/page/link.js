/* Links: a map in the fragment of an address, compressed by the browser. */

import { Grid } from "./grid.js";

async function through(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

export async function fragmentOf(scene) {
  const bytes = await through(new TextEncoder().encode(JSON.stringify(scene)), new CompressionStream("deflate-raw"));
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return "map=" + btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/* The map in a fragment; null if there is none, or it cannot be read. */
export async function sceneIn(fragment) {
  const found = /^#?map=([\w-]+)$/.exec(fragment);
  if (!found) return null;
  try {
    const bytes = Uint8Array.from(atob(found[1].replaceAll("-", "+").replaceAll("_", "/")), (one) => one.charCodeAt(0));
    const scene = JSON.parse(new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw"))));
    new Grid(scene);
    return [scene.start, scene.goal].every((pose) => pose.length === 3) ? scene : null;
  } catch {
    return null;
  }
}
