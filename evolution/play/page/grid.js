/* Grids: the cells of a map as bytes, packed and unpacked as the server packs them, and shapes drawn into them. */

export function unpack(text, count) {
  const bytes = Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
  const cells = new Uint8Array(count);
  for (let i = 0; i < count; i += 1) cells[i] = (bytes[i >> 3] >> (7 - (i & 7))) & 1;
  return cells;
}

export function pack(cells) {
  const bytes = new Uint8Array((cells.length + 7) >> 3);
  for (let i = 0; i < cells.length; i += 1) if (cells[i]) bytes[i >> 3] |= 128 >> (i & 7);
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(text);
}

/* A map that can be drawn on. Positions are in cells: col to the right, row upwards. */
export class Grid {
  constructor(scene) {
    this.height = scene.height;
    this.width = scene.width;
    this.resolution = scene.resolution;
    this.origin = scene.origin;
    this.cells = unpack(scene.cells, scene.height * scene.width);
    this.unknown = scene.unknown ? unpack(scene.unknown, scene.height * scene.width) : null;
  }

  packed() {
    return { cells: pack(this.cells), unknown: this.unknown ? pack(this.unknown) : "" };
  }

  cellAt(x, y) {
    return [Math.floor((x - this.origin[0]) / this.resolution), Math.floor((y - this.origin[1]) / this.resolution)];
  }

  occupied(col, row) {
    return this.inside(col, row) && this.cells[row * this.width + col] === 1;
  }

  inside(col, row) {
    return col >= 0 && row >= 0 && col < this.width && row < this.height;
  }

  put(col, row, value) {
    if (!this.inside(col, row)) return;
    const place = row * this.width + col;
    this.cells[place] = value;
    if (this.unknown) this.unknown[place] = 0;
  }

  disc(col, row, radius, value) {
    const reach = Math.ceil(radius);
    for (let dr = -reach; dr <= reach; dr += 1) {
      for (let dc = -reach; dc <= reach; dc += 1) if (dc * dc + dr * dr <= radius * radius) this.put(col + dc, row + dr, value);
    }
  }

  line(from, to, radius, value) {
    const steps = Math.max(Math.abs(to[0] - from[0]), Math.abs(to[1] - from[1]), 1);
    for (let i = 0; i <= steps; i += 1) {
      this.disc(Math.round(from[0] + (to[0] - from[0]) * i / steps), Math.round(from[1] + (to[1] - from[1]) * i / steps), radius, value);
    }
  }

  rectangle(from, to, value) {
    for (let row = Math.min(from[1], to[1]); row <= Math.max(from[1], to[1]); row += 1) {
      for (let col = Math.min(from[0], to[0]); col <= Math.max(from[0], to[0]); col += 1) this.put(col, row, value);
    }
  }

  circle(from, to, value) {
    this.disc(from[0], from[1], Math.hypot(to[0] - from[0], to[1] - from[1]), value);
  }
}
