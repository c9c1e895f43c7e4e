// What the data of a part means: arrays from base64, and a colour scale for each quantity.

// Light to dark, so that dark paths stay visible on it and colour-blind readers can follow.
const DISTANCE = ["#fff7d6", "#d3ebb9", "#8fd0bd", "#4aa6c3", "#2f76b5"];
// Red: too close, blue: too far; the same scale as in the still pictures.
const SPACING = ["#b2182b", "#ef8a62", "#fddbc7", "#f4f4f2", "#d1e5f0", "#67a9cf", "#2166ac"];
const UNMEASURED = "#9a9a9a";
const COVERAGE = ["#dde2e6", "#d55e00", "#0072b2"];
const COVERAGE_WORDS = ["covered", "gap", "overlap"];
const FONT = { family: "system-ui, sans-serif", size: 12, color: "#1c2730" };
// Share of the colour bar that stands for what was not measured.
const GREY_SHARE = 0.06;
const ARRAYS = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };

function decoded(array) {
  const bytes = Uint8Array.from(atob(array.bdata), (letter) => letter.charCodeAt(0));
  return new ARRAYS[array.dtype](bytes.buffer);
}

// Split an array of three rows into x, y and z.
function rows(array) {
  const values = decoded(array), count = values.length / 3;
  return [0, 1, 2].map((row) => values.subarray(row * count, (row + 1) * count));
}

function unpack(data) {
  const vertices = rows(data.vertices);
  return {
    ...data,
    vertices,
    places: places({ ...data, vertices }),
    faces: rows(data.faces),
    backends: data.backends.map((backend) => ({
      distance: decoded(backend.distance),
      spacing: decoded(backend.ratios),
      coverage: decoded(backend.coverage),
      path: rows(backend.path),
      replay: backend.replay && {
        joints: backend.replay.joints,
        times: decoded(backend.replay.times),
        arm: decoded(backend.replay.arm),
        elbows: decoded(backend.replay.elbows),
        tips: decoded(backend.replay.tips),
        deposit: decoded(backend.replay.deposit),
        bead: rows(backend.replay.bead),
        beadTimes: decoded(backend.replay.beadTimes),
      },
    })),
  };
}

// Where each vertex is in the part's own coordinates, as text.
function places({ rotation, middle, vertices }) {
  return Array.from(vertices[0], (_, at) => {
    const [x, y, z] = [0, 1, 2].map((axis) =>
      (middle[axis] + vertices.reduce((sum, row, place) => sum + rotation[place][axis] * row[at], 0)).toFixed(2));
    return `<br>x ${x}, y ${y}, z ${z} mm in the file`;
  });
}


function evenly(colours, from = 0) {
  return colours.map((colour, place) => [from + ((1 - from) * place) / (colours.length - 1), colour]);
}

function bar(title, ticks) {
  return {
    orientation: "h", x: 0.5, xanchor: "center", y: 0, yanchor: "bottom", len: 0.9, thickness: 12, outlinewidth: 0,
    title: { text: title, side: "top", font: FONT }, tickfont: FONT, ...ticks,
  };
}

// A value for each face: of three corners the middle one, so that a class is one that is there.
function middle(faces, values) {
  const [a, b, c] = faces;
  return Float32Array.from(a, (corner, face) => {
    const x = values[corner], y = values[b[face]], z = values[c[face]];
    return Math.max(Math.min(x, y), Math.min(Math.max(x, y), z));
  });
}

const COLOURINGS = {
  distance: (part, backend) => ({
    intensity: backend.distance, intensitymode: "vertex", cmin: 0, cmax: part.farthest,
    colorscale: evenly(DISTANCE), colorbar: bar("distance from border or seed [mm]", {}),
    said: (at) => `${backend.distance[at].toFixed(2)} mm from border or seed`,
    legend: "Light: near the seed, dark: far from it, as this backend measures.",
  }),
  spacing: (part, backend) => {
    const [low, high] = part.ratios;
    const grey = low - (GREY_SHARE / (1 - GREY_SHARE)) * (high - low);
    // What is not measured falls into the grey end of the scale, everything else is kept out of it.
    const shown = middle(part.faces, backend.spacing).map((value) => (Number.isNaN(value) ? grey : Math.max(value, low)));
    return {
      intensity: shown, intensitymode: "cell", cmin: grey, cmax: high,
      colorscale: [[0, UNMEASURED], [GREY_SHARE * 0.99, UNMEASURED], ...evenly(SPACING, GREY_SHARE)],
      colorbar: bar("local spacing / wanted spacing [1]", {
        tickvals: [low, 0.9, 1, 1.1, high], ticktext: [`≤ ${low}`, "0.9", "1", "1.1", `≥ ${high}`],
      }),
      said: (at) => Number.isNaN(backend.spacing[at])
        ? "outside the outermost path" : `spacing ${backend.spacing[at].toFixed(3)} of the wanted one`,
      legend: "Red: paths too close, blue: too far apart, white: as wanted. Grey: outside the outermost path, which has no neighbour there.",
    };
  },
  coverage: (part, backend) => ({
    intensity: middle(part.faces, backend.coverage), intensitymode: "cell", cmin: -0.5, cmax: 2.5,
    colorscale: COVERAGE.flatMap((colour, place) => [[place / 3, colour], [(place + 1) / 3, colour]]),
    colorbar: bar("coverage of the surface", { tickvals: [0, 1, 2], ticktext: COVERAGE_WORDS }),
    said: (at) => COVERAGE_WORDS[backend.coverage[at]],
    legend: "Orange: farther than 0.55 spacings from every path. Blue: within 0.45 spacings of two stretches of path.",
  }),
};
