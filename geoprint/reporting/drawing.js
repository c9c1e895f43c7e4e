// From the state of a scene to what plotly.js draws in one view: surface, paths, robot, axes and camera.

// The box around the part, in sizes of the part; above it room for the needle where there is a robot.
const MARGIN = 0.06, HEADROOM = 0.2;
const LIGHT = { x: -40000, y: -50000, z: 77000 };
// Places of the traces that move: bead, arm, tool.
const MOVING = [5, 6, 7];
// A line of nothing: plotly.js fails on one without any point.
const NOTHING = [[null], [null], [null]];
// How long a speck in the corner of everything is, over the size of that.
const SPECK = 1e-6;
// The part fills about this share of the plot.
const SEEN_SHARE = 0.65;
// As many pixels as the screen has: plotly.js takes twice as many each way otherwise, which a slow machine feels.
const CONFIG = { displayModeBar: false, displaylogo: false, showTips: false, scrollZoom: true,
  plotGlPixelRatio: Math.min(Math.max(devicePixelRatio, 1), 2) };

function line(points, colour, width) {
  return {
    type: "scatter3d", mode: "lines", x: points[0], y: points[1], z: points[2], hoverinfo: "skip", showlegend: false,
    line: { color: colour, width }, connectgaps: false,
  };
}

// A solid of one colour; without one it is not drawn.
function solid(kind, colour, visible, places = kind?.vertices) {
  if (!visible || !kind?.vertices[0].length) return { type: "mesh3d", visible: false };
  const [x, y, z] = places, [i, j, k] = kind.faces;
  return {
    type: "mesh3d", x, y, z, i, j, k, color: colour, hoverinfo: "skip", flatshading: true, lightposition: LIGHT,
    lighting: { ambient: 0.5, diffuse: 0.6, specular: 0.08, roughness: 0.7, fresnel: 0.05,
      vertexnormalsepsilon: 0, facenormalsepsilon: 0 },
  };
}

// Line widths in pixels: shares of the spacing as it is seen about now, so that dense paths leave colour between them.
function widths(part, state, pixels) {
  const seen = (part.spacing * SEEN_SHARE * pixels) / corners(part, state).size;
  const between = (low, value, high) => Math.min(Math.max(value, low), high);
  return { path: between(1, 0.14 * seen, 2.5), bead: between(1.5, 0.5 * seen, 8) };
}

// What moves, at a moment of the replay: for each trace its places, and of the tool its colour.
function movingPlaces(part, replay, time, colours) {
  const now = moment(replay, time), motion = motions(part.machine, now.joints);
  const laid = now.laid
    ? placed(replay.bead.map((row) => row.subarray(0, now.laid)), standing(replay, time).part) : NOTHING;
  return [{ places: laid }, { places: moved(part.machine.kinds.arm, motion) },
    { places: moved(part.machine.kinds.tool, motion), color: now.valve ? colours.laying : colours.tool }];
}

// Paths as they are shown: of a stack those of the layers up to one, the uppermost of them set off.
function pathTrace(backend, state, width, stand) {
  if (state.colour === "beads") {
    const beads = beadsOf(backend);
    return { ...solid(beads, BEADS, state.paths, placed(beads.vertices, stand.part)), flatshading: false };
  }
  if (!backend.layers) return { ...line(placed(backend.path, stand.part), PATH, width), visible: state.paths };
  const [before, count] = [backend.layers[state.layers - 2] ?? 0, backend.layers[Math.min(state.layers, backend.layers.length) - 1] ?? 0];
  if (!count) return { ...line(NOTHING, PATH, width), visible: false };
  const drawn = line(backend.path.map((row) => row.subarray(0, count)), PATH, width);
  drawn.line.color = Array.from({ length: count }, (_, at) => (at < before ? PATH_BELOW : PATH));
  return drawn;
}

function traces(part, backend, colouring, state, pixels) {
  const width = widths(part, state, pixels), colours = theme();
  const robot = state.robot && Boolean(part.machine && backend.replay);
  const stand = robot ? standing(backend.replay, state.time) : AT_REST;
  const [x, y, z] = placed(part.vertices, stand.part), [i, j, k] = part.faces, { machine } = part;
  const surface = {
    type: "mesh3d", x, y, z, i, j, k, colorscale: colouring.colorscale, ...colouring.values(),
    showscale: false, hoverinfo: "none",
    // Faces are small in proportion to all that is drawn: without the zeros plotly.js takes them for flat ones.
    lighting: { ambient: 0.62, diffuse: 0.5, specular: 0.03, roughness: 0.9, fresnel: 0.02,
      vertexnormalsepsilon: 0, facenormalsepsilon: 0 },
    lightposition: LIGHT, flatshading: false,
  };
  const [laid, arm, tool] = robot ? movingPlaces(part, backend.replay, state.time, colours) : [{ places: NOTHING }];
  return [
    surface,
    pathTrace(backend, state, width.path, stand),
    cubeTrace(part),
    solid(machine?.kinds.body, colours.body, robot, robot && placed(machine.kinds.body.vertices, stand.part)),
    solid(machine?.kinds.cell, colours.cell, robot),
    { ...line(laid.places, BEAD, width.bead), visible: robot },
    solid(machine?.kinds.arm, colours.arm, robot, arm?.places),
    solid(machine?.kinds.tool, tool?.color, robot, tool?.places),
    solid(machine?.kinds.table, colours.cell, robot, robot && tablePlaces(machine, stand)),
  ];
}

// Breaks of a path are no places.
function boxOf(places, box = { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] }) {
  return {
    low: box.low.map((value, axis) => places[axis].reduce((least, each) => (each < least ? each : least), value)),
    high: box.high.map((value, axis) => places[axis].reduce((most, each) => (each > most ? each : most), value)),
  };
}

// Boxes around the part, around it however the table holds it, around everything that moves, and around all there is; sought once.
function boxes(part) {
  if (part.boxes) return part.boxes;
  const { machine } = part, surface = boxOf(part.vertices);
  // Layers stand over the part, and out beyond it.
  const own = part.backends.reduce((box, { layers, path }) => (layers ? boxOf(path, box) : box), surface);
  const replays = part.backends.flatMap(({ replay }) => replay ?? []);
  const frames = replays.flatMap(({ table }) =>
    (table?.part ?? []).map((motion, frame) => ({ part: motion, solids: table.solids[frame] })));
  const stands = frames.length ? frames : [AT_REST];
  const inAll = (places, box) => stands.reduce((found, { part: motion }) => boxOf(placed(places, motion), found), box);
  const tilted = inAll(part.vertices, own);
  let robot = tilted, all = tilted;
  if (machine && replays.length) {
    const reach = reachOf(machine, replays), edges = own.low.map((_, axis) => [reach.low[axis], reach.high[axis]]);
    robot = boxOf(edges, tilted);
    if (machine.kinds.body.vertices[0].length) robot = inAll(machine.kinds.body.vertices, robot);
    if (machine.kinds.table.vertices[0].length) {
      robot = stands.reduce((box, stand) => boxOf(tablePlaces(machine, stand), box), robot);
    }
    all = machine.kinds.cell.vertices[0].length ? boxOf(machine.kinds.cell.vertices, robot) : robot;
  }
  return (part.boxes = { own, tilted, robot, all });
}

function corners(part, state) {
  const { low, high } = boxes(part)[state.frame === "robot" ? "robot" : state.robot ? "tilted" : "own"];
  return { low, high, size: Math.max(...high.map((value, axis) => value - low[axis])) };
}

// An unseen cube around everything. plotly.js shades a surface in the proportions of all that is drawn: with a cube
// the light stays as it is when the robot comes and goes. Two specks in its corners make it, beyond the axes: whatever
// is transparent would have everything drawn twice, and markers need programs of their own.
function cubeTrace(part) {
  const { low, high } = boxes(part).all, size = Math.max(...high.map((value, axis) => value - low[axis]));
  const specks = low.map((value, axis) => {
    const [first, last] = [-1, 1].map((side) => 0.5 * (value + high[axis] + side * size));
    return [first, first + SPECK * size, null, last - SPECK * size, last];
  });
  return line(specks, theme().stage, 1);
}

function extent(part, state) {
  const { low, high, size } = corners(part, state);
  const ranges = low.map((value, axis) => [value - MARGIN * size, high[axis] + MARGIN * size]);
  if (state.frame === "part" && state.robot) ranges[2][1] += HEADROOM * size;
  return ranges;
}

function layout(part, state) {
  const ranges = extent(part, state), lengths = ranges.map(([low, high]) => high - low);
  const largest = Math.max(...lengths), { ink, soft, rule, stage } = theme();
  const axis = (place) => ({
    title: { text: "" }, range: ranges[place], autorange: false,
    tickfont: { family: FONT, size: 10, color: soft }, nticks: 4, gridcolor: rule, zeroline: false,
    showspikes: false, showbackground: false, linecolor: soft, showline: true,
  });
  return {
    margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: stage, font: { family: FONT, size: 12, color: ink },
    hovermode: "closest",
    scene: {
      xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), aspectmode: "manual",
      camera: structuredClone(state.camera),
      aspectratio: { x: lengths[0] / largest, y: lengths[1] / largest, z: lengths[2] / largest },
    },
  };
}
