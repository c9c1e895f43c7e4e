// Draws the 3D scenes of the report and answers its controls. Needs plotly.js; fetches nothing.
"use strict";

(() => {
  // Light to dark, so that dark paths stay visible on it and grey-blind readers can follow.
  const DISTANCE = ["#fff7d6", "#d3ebb9", "#8fd0bd", "#4aa6c3", "#2f76b5"];
  // Red: too close, blue: too far; the same scale as in the still pictures.
  const SPACING = ["#b2182b", "#ef8a62", "#fddbc7", "#f4f4f2", "#d1e5f0", "#67a9cf", "#2166ac"];
  const UNMEASURED = "#9a9a9a";
  const COVERAGE = ["#dde2e6", "#d55e00", "#0072b2"];
  const COVERAGE_WORDS = ["covered", "gap", "overlap"];
  const PATH = "#17212b", BEAD = "#111111", ARM = "#4a5a6a", NEEDLE = "#c2410c";
  const FONT = { family: "system-ui, sans-serif", size: 12, color: "#1c2730" };
  // Share of the colour bar that stands for what was not measured.
  const GREY_SHARE = 0.06;
  // The box around the part, in sizes of the part; above it room for the needle where there is a robot.
  const MARGIN = 0.06, HEADROOM = 0.2;
  // Seen obliquely from above; light from the left behind the reader.
  const CAMERA = { eye: { x: 0.22, y: -1.27, z: 0.98 }, up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: -0.18 } };
  const LIGHT = { x: -40000, y: -50000, z: 77000 };
  // Places of the traces that move: bead, arm, needle.
  const ROBOT = [3, 4, 5];
  const TURN = Math.PI / 24, ZOOM = 1.15;
  // As many scenes are kept alive at once; browsers allow about sixteen.
  const MOST_LIVE = 4;

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
    return {
      ...data,
      vertices: rows(data.vertices),
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

  // ---- colours -----------------------------------------------------------------------------------------------

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
      colorscale: evenly(DISTANCE), colorbar: bar("distance from the seed [mm]", {}),
      said: (at) => `${backend.distance[at].toFixed(2)} mm from the seed`,
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

  // ---- replay ------------------------------------------------------------------------------------------------

  // Number of values not above the wanted one; they do not fall.
  function countUpTo(values, wanted) {
    let low = 0, high = values.length;
    while (low < high) {
      const half = (low + high) >> 1;
      if (values[half] <= wanted) low = half + 1; else high = half;
    }
    return low;
  }

  function pose(replay, time) {
    const after = Math.min(Math.max(countUpTo(replay.times, time), 1), replay.times.length - 1), before = after - 1;
    const share = Math.min(Math.max((time - replay.times[before]) / (replay.times[after] - replay.times[before]), 0), 1);
    const between = (values, size) => Array.from({ length: size }, (_, place) =>
      (1 - share) * values[before * size + place] + share * values[after * size + place]);
    const points = (flat) => [0, 1, 2].map((axis) => flat.filter((_, place) => place % 3 === axis));
    const arm = between(replay.arm, 3 * replay.joints), elbow = between(replay.elbows, 3), tip = between(replay.tips, 3);
    return {
      arm: points([...arm, ...elbow]), needle: points([...elbow, ...tip]),
      laid: replay.bead.map((row) => row.subarray(0, countUpTo(replay.beadTimes, time))),
      deposit: replay.deposit[share < 0.5 ? before : after] === 1,
    };
  }

  // ---- scene -------------------------------------------------------------------------------------------------

  function line(points, colour, width, mode = "lines") {
    return {
      type: "scatter3d", mode, x: points[0], y: points[1], z: points[2], hoverinfo: "skip", showlegend: false,
      line: { color: colour, width }, marker: { color: colour, size: width * 0.9 }, connectgaps: false,
    };
  }

  function traces(part, state) {
    const backend = part.backends[state.backend];
    const { legend, said, ...colouring } = COLOURINGS[state.colour](part, backend);
    const [x, y, z] = part.vertices, [i, j, k] = part.faces;
    const surface = {
      type: "mesh3d", x, y, z, i, j, k, ...colouring, text: part.places.map((place, at) => said(at) + place),
      hovertemplate: "%{text}<extra></extra>",
      // Faces are small in proportion to all that is drawn: without the zeros plotly.js takes them for flat ones.
      lighting: { ambient: 0.62, diffuse: 0.5, specular: 0.03, roughness: 0.9, fresnel: 0.02,
        vertexnormalsepsilon: 0, facenormalsepsilon: 0 },
      lightposition: LIGHT, flatshading: false,
    };
    const nothing = [[null], [null], [null]];
    const now = state.robot && backend.replay ? pose(backend.replay, state.time) : null;
    return {
      legend,
      list: [
        surface,
        { ...line(backend.path, PATH, state.robot ? 1.5 : 2.5), visible: state.paths },
        frameTrace(part),
        line(now ? now.laid : nothing, BEAD, 7),
        line(now ? now.arm : nothing, ARM, 9, "lines+markers"),
        line(now ? now.needle : nothing, NEEDLE, 6),
      ],
    };
  }

  // Two opposite corners of the box around the part, or around everything that moves too.
  function corners(part, withRobot) {
    const low = [], high = [];
    const reach = (axis, value) => {
      low[axis] = Math.min(low[axis] ?? value, value);
      high[axis] = Math.max(high[axis] ?? value, value);
    };
    part.vertices.forEach((row, axis) => row.forEach((value) => reach(axis, value)));
    if (withRobot) {
      part.backends.forEach(({ replay }) => replay?.arm.forEach((value, place) => reach(place % 3, value)));
    }
    return { low, high, size: Math.max(...high.map((value, axis) => value - low[axis])) };
  }

  // An unseen cube around everything. plotly.js shades a surface in the proportions of all that is drawn: with a cube
  // the light stays as it is when the robot comes and goes.
  function frameTrace(part) {
    const { low, high, size } = corners(part, true);
    const [x, y, z] = low.map((value, axis) => [-1, 1].map((side) => 0.5 * (value + high[axis] + side * size)));
    return { type: "scatter3d", mode: "markers", x, y, z, hoverinfo: "skip", showlegend: false, opacity: 0,
      marker: { size: 0.1 } };
  }

  function extent(part, state) {
    const { low, high, size } = corners(part, state.frame === "robot");
    const ranges = low.map((value, axis) => [value - MARGIN * size, high[axis] + MARGIN * size]);
    if (state.frame === "part" && part.backends.some(({ replay }) => replay)) ranges[2][1] += HEADROOM * size;
    return ranges;
  }

  function layout(part, state) {
    const ranges = extent(part, state), lengths = ranges.map(([low, high]) => high - low);
    const largest = Math.max(...lengths);
    const axis = (letter, place) => ({
      title: { text: `${letter} [mm]`, font: { ...FONT, size: 11 } }, range: ranges[place], autorange: false,
      tickfont: { ...FONT, size: 10, color: "#5b6770" }, nticks: 5, gridcolor: "#d9dfe4", zeroline: false,
      showspikes: false, showbackground: false, linecolor: "#9aa5ae", showline: true,
    });
    return {
      margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "#ffffff", font: FONT, hovermode: "closest",
      hoverlabel: { bgcolor: "#ffffff", bordercolor: "#1c2730", font: FONT },
      scene: {
        xaxis: axis("x", 0), yaxis: axis("y", 1), zaxis: axis("z", 2), domain: { x: [0, 1], y: [0.13, 1] },
        aspectmode: "manual", camera: state.camera,
        aspectratio: { x: lengths[0] / largest, y: lengths[1] / largest, z: lengths[2] / largest },
      },
    };
  }

  const CONFIG = { displayModeBar: false, displaylogo: false, responsive: true, showTips: false, scrollZoom: true };

  function turned({ x, y, z }, about, angle) {
    const cosine = Math.cos(angle), sine = Math.sin(angle), v = [x, y, z];
    const along = about.reduce((sum, value, axis) => sum + value * v[axis], 0);
    const side = [0, 1, 2].map((axis) =>
      about[(axis + 1) % 3] * v[(axis + 2) % 3] - about[(axis + 2) % 3] * v[(axis + 1) % 3]);
    const [a, b, c] = v.map((value, axis) => value * cosine + side[axis] * sine + about[axis] * along * (1 - cosine));
    return { x: a, y: b, z: c };
  }

  function unit(vector) {
    const length = Math.hypot(...vector) || 1;
    return vector.map((value) => value / length);
  }

  function cameraAfter(key, camera) {
    const { eye } = camera, up = unit([camera.up.x, camera.up.y, camera.up.z]);
    const right = unit([up[1] * eye.z - up[2] * eye.y, up[2] * eye.x - up[0] * eye.z, up[0] * eye.y - up[1] * eye.x]);
    const scaled = (factor) => ({ x: eye.x * factor, y: eye.y * factor, z: eye.z * factor });
    const eyes = {
      ArrowLeft: () => turned(eye, up, -TURN), ArrowRight: () => turned(eye, up, TURN),
      ArrowUp: () => turned(eye, right, -TURN), ArrowDown: () => turned(eye, right, TURN),
      "+": () => scaled(1 / ZOOM), "=": () => scaled(1 / ZOOM), "-": () => scaled(ZOOM),
    };
    if (!(key in eyes)) return null;
    const moved = eyes[key](), length = Math.hypot(moved.x, moved.y, moved.z);
    // Not over the pole, where left and right would change places.
    const height = (moved.x * up[0] + moved.y * up[1] + moved.z * up[2]) / length;
    return Math.abs(height) > 0.995 ? camera : { ...camera, eye: moved };
  }

  // ---- one part ----------------------------------------------------------------------------------------------

  class Scene {
    constructor(root) {
      this.root = root;
      this.key = root.dataset.part;
      this.plot = root.querySelector(".plot");
      this.status = root.querySelector(".status");
      this.legend = root.querySelector(".legend");
      this.player = root.querySelector("div.player");
      this.part = null;
      this.live = false;
      this.playing = false;
      this.listen();
    }

    start() {
      if (this.live || this.failed) return;
      if (!this.part) {
        this.part = unpack(JSON.parse(document.getElementById(`${this.key}-data`).textContent));
        this.part.places = places(this.part);
      }
      this.state ??= { backend: 0, colour: "spacing", paths: true, robot: false, frame: "part", time: Infinity,
        camera: structuredClone(CAMERA) };
      this.readControls();
      try {
        if (!document.createElement("canvas").getContext("webgl")) throw new Error("WebGL is missing");
        const { list, legend } = traces(this.part, this.state);
        this.legend.textContent = legend;
        this.ready = Plotly.newPlot(this.plot, list, layout(this.part, this.state), CONFIG).then(() => {
          this.plot.on("plotly_relayout", () => { this.state.camera = this.camera(); });
          this.root.classList.add("live");
          this.live = true;
          this.status.textContent = "Drag to turn, scroll to zoom, or use the arrow keys, plus and minus.";
        }).catch((error) => this.fail(error));
      } catch (error) {
        this.fail(error);
      }
    }

    fail(error) {
      this.failed = true;
      this.root.classList.add("failed");
      this.status.textContent = `This browser draws no 3D here (${error.message}); the still picture stands in.`;
    }

    stop() {
      if (!this.live) return;
      this.pause();
      this.state.camera = this.camera();
      Plotly.purge(this.plot);
      this.live = false;
      this.root.classList.remove("live");
    }

    camera() {
      return this.plot._fullLayout ? structuredClone(this.plot.layout.scene.camera) : this.state.camera;
    }

    control(name) {
      return this.root.querySelector(`[name="${this.key}-${name}"]:checked`)?.value;
    }

    get replay() {
      return this.part.backends[this.state.backend].replay;
    }

    readControls() {
      const { state } = this;
      state.backend = Number(this.control("backend"));
      state.colour = this.control("colour");
      state.paths = this.control("paths") !== undefined;
      state.frame = this.control("frame") ?? "part";
      state.robot = this.control("robot") !== undefined;
      this.showTime();
    }

    showTime() {
      if (!this.player) return;
      const { replay } = this, slider = this.player.querySelector("input");
      this.player.querySelectorAll("input, button, select").forEach((control) => { control.disabled = !replay; });
      const output = this.player.querySelector("output");
      if (!replay) { output.textContent = "not printable"; return; }
      const end = replay.times[replay.times.length - 1];
      this.state.time = (Number(slider.value) / Number(slider.max)) * end;
      const text = `${this.state.time.toFixed(1)} of ${end.toFixed(1)} s`;
      const laying = this.state.robot ? (pose(replay, this.state.time).deposit ? ", depositing" : ", travelling") : "";
      output.textContent = text + laying;
      slider.setAttribute("aria-valuetext", text);
    }

    redraw() {
      this.readControls();
      if (!this.live) return;
      const { list, legend } = traces(this.part, this.state);
      this.legend.textContent = legend;
      Plotly.react(this.plot, list, layout(this.part, { ...this.state, camera: this.camera() }), CONFIG);
    }

    // Move the robot alone: the surface is not drawn anew.
    moveRobot() {
      if (!this.live || !this.replay) return;
      const { laid, arm, needle } = pose(this.replay, this.state.time);
      const points = [laid, arm, needle];
      const scene = this.plot._fullLayout.scene._scene, full = ROBOT.map((place) => this.plot._fullData[place]);
      const drawn = full.map(({ uid }) => scene?.traces?.[uid]);
      // Through plotly.js's public door every step would upload the surface again, a hundred times slower.
      if (drawn.every((trace) => typeof trace?.update === "function")) {
        drawn.forEach((trace, place) => {
          const [x, y, z] = points[place];
          trace.update({ ...full[place], x, y, z });
        });
        scene.glplot.redraw();
        return;
      }
      const column = (axis) => points.map((each) => each[axis]);
      Plotly.restyle(this.plot, { x: column(0), y: column(1), z: column(2) }, ROBOT);
    }

    showRobot() {
      const box = this.root.querySelector(`[name="${this.key}-robot"]`);
      if (box.checked) return;
      box.checked = true;
      this.redraw();
    }

    play() {
      const slider = this.player.querySelector("input"), button = this.player.querySelector("button");
      if (Number(slider.value) >= Number(slider.max)) slider.value = 0;
      this.showRobot();
      this.playing = true;
      button.textContent = "Pause";
      const end = this.replay.times[this.replay.times.length - 1];
      let elapsed = (Number(slider.value) / Number(slider.max)) * end, last = performance.now();
      const tick = (now) => {
        if (!this.playing) return;
        elapsed += ((now - last) / 1000) * Number(this.player.querySelector("select").value);
        last = now;
        slider.value = (elapsed / end) * Number(slider.max);
        this.showTime();
        this.moveRobot();
        if (elapsed >= end) this.pause(); else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    pause() {
      this.playing = false;
      if (this.player) this.player.querySelector("button").textContent = "Play";
    }

    listen() {
      this.root.querySelector(".controls").addEventListener("change", (event) => {
        if (event.target.name === `${this.key}-backend`) this.pause();
        if (event.target.name === `${this.key}-frame` && event.target.value === "robot") {
          this.root.querySelector(`[name="${this.key}-robot"]`).checked = true;
        }
        this.redraw();
      });
      this.root.querySelector(".reset").addEventListener("click", () => {
        this.state.camera = structuredClone(CAMERA);
        if (this.live) Plotly.relayout(this.plot, { "scene.camera": this.state.camera });
      });
      this.plot.addEventListener("keydown", (event) => {
        if (!this.live || event.ctrlKey || event.altKey || event.metaKey) return;
        const camera = event.key === "Home" ? structuredClone(CAMERA) : cameraAfter(event.key, this.camera());
        if (!camera) return;
        event.preventDefault();
        Plotly.relayout(this.plot, { "scene.camera": camera });
      });
      if (!this.player) return;
      this.player.querySelector("input").addEventListener("input", () => {
        this.pause();
        this.showRobot();
        this.showTime();
        this.moveRobot();
      });
      this.player.querySelector("button").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    }
  }

  document.documentElement.classList.add("scripted");

  // Scenes come alive near the screen; the one left longest ago gives way.
  const live = [];
  const scenes = new Map([...document.querySelectorAll(".scene")].map((root) => [root, new Scene(root)]));
  const watcher = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      const scene = scenes.get(target), place = live.indexOf(scene);
      if (place >= 0) live.splice(place, 1);
      live.push(scene);
      scene.start();
      while (live.length > MOST_LIVE) live.shift().stop();
    }
  }, { rootMargin: "200px" });
  scenes.forEach((_, root) => watcher.observe(root));
})();
