// Files from and to the user.

import { el } from "./dom.js";

/** Offers a text as a file. */
export function offer(name, content, type = "text/plain") {
  const url = URL.createObjectURL(new Blob([content], { type }));
  el("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Bytes of a message besides the content of a file. */
const KEYS = 4096;

/** The content of a file in base64, which has four bytes for three. Fails for a file that does not fit a message of so many bytes. */
export async function base64(file, largest, wanted) {
  check(file, file.size, ((largest - KEYS) * 3) / 4, wanted);
  const bytes = new Uint8Array(await file.arrayBuffer());
  let binary = "";
  for (let at = 0; at < bytes.length; at += 0x8000) binary += String.fromCharCode(...bytes.subarray(at, at + 0x8000));
  return btoa(binary);
}

/** The text of a file. In a message, a line feed has two bytes. */
export async function textOf(file, largest, wanted) {
  const limit = largest - KEYS;
  check(file, file.size, limit, wanted);
  const content = await file.text();
  check(file, sizeOf(JSON.stringify(content)), limit, wanted);
  return content;
}

/** The bytes of a text in a message. */
export function sizeOf(content) {
  return new TextEncoder().encode(content).length;
}

export function megabytes(bytes) {
  return `${(bytes / 1e6).toFixed(1)} MB`;
}

function check(file, bytes, limit, wanted) {
  if (bytes > limit) throw new Error(`${file.name} is too large (${megabytes(file.size)}): choose ${wanted}, of at most ${megabytes(limit)}`);
}
