// Draws coloured triangles, lines and one map in space by WebGL 2, with a depth buffer and nothing else: no library that does this is
// smaller than the rest of the page.

/** Numbers of a corner: x, y, z, red, green, blue, opacity. */
const NUMBERS = 7;

/** Corners of triangles, or of lines, one after another; `cull` leaves out triangles seen from behind. @typedef {{ lines?: boolean, cull?: boolean, corners: number[] }} Layer */
/** A map that lies over triangles: red, green, blue and opacity of its cells from the south-west, and its edges west, south, east, north. @typedef {{ corners: number[], cells: number[][][], edges: [number, number, number, number] }} Map3D */

const VERTEX = `#version 300 es
uniform mat4 projection;
uniform vec4 edges;
in vec3 place;
in vec4 colour;
out vec4 own;
out vec2 cell;
void main() {
  own = colour;
  cell = (place.xy - edges.xy) / (edges.zw - edges.xy);
  gl_Position = projection * vec4(place, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision mediump float;
uniform sampler2D cells;
uniform bool mapped;
in vec4 own;
in vec2 cell;
out vec4 seen;
void main() {
  vec4 colour = mapped ? texture(cells, cell) * own : own;
  if (colour.a < 0.01) discard;
  seen = vec4(colour.rgb * colour.a, colour.a);
}`;

/** @param {WebGL2RenderingContext} gl @param {number} type @param {string} source */
function shader(gl, type, source) {
  const made = /** @type {WebGLShader} */ (gl.createShader(type));
  gl.shaderSource(made, source);
  gl.compileShader(made);
  return made;
}

/** @param {WebGL2RenderingContext} gl */
function linked(gl) {
  const program = /** @type {WebGLProgram} */ (gl.createProgram());
  gl.attachShader(program, shader(gl, gl.VERTEX_SHADER, VERTEX));
  gl.attachShader(program, shader(gl, gl.FRAGMENT_SHADER, FRAGMENT));
  gl.bindAttribLocation(program, 0, "place");
  gl.bindAttribLocation(program, 1, "colour");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program) ?? "shaders");
  gl.useProgram(program);
  return program;
}

/**
 * A painter on a canvas; null where the browser has no WebGL 2.
 * @param {HTMLCanvasElement} canvas
 */
export function painter(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) return null;
  const program = linked(gl);
  const uniform = (/** @type {string} */ name) => gl.getUniformLocation(program, name);
  const [projection, edges, mapped] = [uniform("projection"), uniform("edges"), uniform("mapped")];
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  // edges stay before the faces that they belong to
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(1, 1);
  /** @type {{ mode: number, cull: boolean, isMap: boolean, count: number, buffer: WebGLBuffer | null }[]} */
  let held = [];
  const release = () => held.forEach(({ buffer }) => gl.deleteBuffer(buffer));

  return {
    /** Takes what is drawn from now on: the map, then layers in their order. @param {Layer[]} layers @param {Map3D | null} map */
    take(layers, map) {
      release();
      held = [...(map ? [{ corners: map.corners, isMap: true }] : []), ...layers].map((layer) => {
        const { lines = false, cull = false, isMap = false, corners } = /** @type {Layer & { isMap?: boolean }} */ (layer);
        const buffer = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STATIC_DRAW);
        return { mode: lines ? gl.LINES : gl.TRIANGLES, cull, isMap, count: corners.length / NUMBERS, buffer };
      });
      if (!map) return;
      gl.uniform4fv(edges, map.edges);
      const pixels = Uint8Array.from(map.cells.flat().flatMap(([r = 0, g = 0, b = 0, opacity = 255]) => [r, g, b, opacity]));
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, map.cells[0]?.length ?? 0, map.cells.length, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    },

    /** @param {number[]} matrix from the room's frame to clip space, column by column */
    draw(matrix) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix4fv(projection, false, matrix);
      for (const { mode, cull, isMap, count, buffer } of held) {
        if (cull) gl.enable(gl.CULL_FACE);
        else gl.disable(gl.CULL_FACE);
        gl.uniform1i(mapped, Number(isMap));
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        for (const [index, size, from] of /** @type {const} */ ([[0, 3, 0], [1, 4, 3]])) {
          gl.enableVertexAttribArray(index);
          gl.vertexAttribPointer(index, size, gl.FLOAT, false, 4 * NUMBERS, 4 * from);
        }
        gl.drawArrays(mode, 0, count);
      }
    },

    /** Gives the graphics memory back. */
    dispose() {
      release();
      gl.getExtension("WEBGL_lose_context")?.loseContext();
    },
  };
}
