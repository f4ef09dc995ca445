/** Bodies of spem.server.arrays: a JSON header and little-endian numbers, read where they lie. */

const KINDS = {
  "<f4": Float32Array,
  "<f8": Float64Array,
  "|i1": Int8Array,
  "|u1": Uint8Array,
  "<i2": Int16Array,
  "<u2": Uint16Array,
  "<i4": Int32Array,
  "<u4": Uint32Array,
};

/** Header and arrays of a body; each array is `{values, shape}`, its values a view into the body. */
export function unpackArrays(body) {
  const length = new DataView(body).getUint32(0, true);
  const { arrays: listed, ...header } = JSON.parse(new TextDecoder().decode(new Uint8Array(body, 4, length)));
  const arrays = {};
  for (const { name, type, shape, offset } of listed) {
    const count = shape.reduce((product, extent) => product * extent, 1);
    arrays[name] = { values: new KINDS[type](body, 4 + length + offset, count), shape };
  }
  return { header, arrays };
}
