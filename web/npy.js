// Arrays of NumPy, as the service writes those of a year: float32 in rows, version 1.0 of the format.

/** An array of two dimensions, row by row. @typedef {{ rows: number, columns: number, values: Float32Array }} Rows */

/** First bytes of every file, and how many there are before the header: these, version and length. */
const MAGIC = [0x93, ...new TextEncoder().encode("NUMPY")];
const PREFIX = 10;

/** Reads an array of two dimensions of little-endian floats of 4 bytes; throws on anything else. @param {ArrayBuffer} buffer @returns {Rows} */
export function readNpy(buffer) {
  const bytes = new Uint8Array(buffer);
  const start = PREFIX + (bytes[8] ?? 0) + 256 * (bytes[9] ?? 0);
  const header = new TextDecoder().decode(bytes.subarray(PREFIX, start));
  const [, rows, columns] = /'shape': \((\d+), (\d+)\)/.exec(header) ?? [];
  const isRead = MAGIC.every((byte, i) => bytes[i] === byte) && header.includes("'<f4'") && header.includes("'fortran_order': False");
  if (!isRead || rows === undefined || columns === undefined) throw new Error("this is no array of two dimensions of float32 by rows");
  // browsers run on little-endian machines; the format puts values at multiples of 16 bytes
  return { rows: Number(rows), columns: Number(columns), values: new Float32Array(buffer, start, Number(rows) * Number(columns)) };
}
