"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const { arrays, charts } = read("charts");
  const marks = read("marks");
  const area = document.getElementById("plot-area");
  const HEIGHT = 210;
  const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3], [4, 2], [12, 5]];
  const FAINT = 0.35;
  const widthOf = (frame) => Math.max(frame.clientWidth - 23, 200);
  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const ink = (index) => color(index === null ? "--ink" : `--c${index % 10}`);
  const unpacked = arrays.map(({ base, data }) => {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    return Array.from(new Float32Array(bytes.buffer), (value) => base + value);
  });

  // Points, of which several may have one x.
  const scattered = (series) => {
    const points = series.flatMap((one, index) =>
      unpacked[one.x].map((x, i) => ({ x, y: unpacked[one.y][i], index })),
    );
    points.sort((one, other) => one.x - other.x);
    const column = (index) => points.map((p) => (p.index === index && Number.isFinite(p.y) ? p.y : null));
    return [points.map((p) => p.x), ...series.map((_, index) => column(index))];
  };

  // The lines of a chart have times of their own: on the union of them, what lies between two
  // points of a line is on the straight between them, as it is drawn.
  const joined = ({ kind, series }) => {
    if (kind === "points") return scattered(series);
    const table = uPlot.join(series.map((one) => [unpacked[one.x], unpacked[one.y]]));
    const time = table[0];
    for (const values of table.slice(1)) {
      let last = -1;
      for (let i = 0; i < values.length; i++) {
        if (values[i] === null || values[i] === undefined) continue;
        if (last >= 0 && Number.isFinite(values[last]) && Number.isFinite(values[i])) {
          for (let k = last + 1; k < i; k++) {
            const share = (time[k] - time[last]) / (time[i] - time[last]);
            values[k] = values[last] + share * (values[i] - values[last]);
          }
        }
        last = i;
      }
      for (let i = 0; i < values.length; i++) {
        if (!Number.isFinite(values[i])) values[i] = null;
      }
    }
    return table;
  };

  const short = (value) => {
    if (value === null || value === undefined) return "";
    const size = Math.abs(value);
    const text =
      size && (size < 1e-3 || size >= 1e6)
        ? value.toExponential(3).replace(/\.?0+e/, "e").replace("e+", "e")
        : String(Number(value.toPrecision(5)));
    return text.replace("-", "\u2212");
  };

  // Bounds of checks over their windows, and events across the height.
  const annotate = (chart) => (u) => {
    const { ctx, bbox } = u;
    const ratio = uPlot.pxRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = ratio;
    ctx.font = `${11 * ratio}px sans-serif`;
    if (chart.kind === "lines") {
      for (const mark of marks) {
        const x = Math.round(u.valToPos(mark.time, "x", true));
        const grave = mark.level === "error" || mark.level === "fatal";
        ctx.strokeStyle = color(grave ? "--fail" : mark.level === "warning" ? "--warn" : "--faint");
        ctx.globalAlpha = 0.5;
        ctx.setLineDash([]);
        ctx.beginPath();
        ctx.moveTo(x, bbox.top);
        ctx.lineTo(x, bbox.top + bbox.height);
        ctx.stroke();
      }
    }
    ctx.globalAlpha = 1;
    for (const bound of chart.bounds) {
      const place = ([x, y]) => [
        x === null ? bbox.left : u.valToPos(x, "x", true),
        y === null ? bbox.top : u.valToPos(y, "y", true),
      ];
      const [x0, y0] = place(bound.from);
      const [x1, y1] = place(bound.to);
      const upright = chart.kind === "bars";
      const [left, end] = [bbox.left, bbox.left + bbox.width];
      if (x0 > end || x1 < left) continue;
      ctx.strokeStyle = ctx.fillStyle = upright ? color("--fail") : ink(bound.color);
      ctx.setLineDash([5 * ratio, 3 * ratio]);
      ctx.beginPath();
      ctx.moveTo(x0, y0);
      ctx.lineTo(x1, y1);
      ctx.stroke();
      // The text ends where the line does; it begins at the left edge where it has no room there.
      const space = ctx.measureText(bound.text).width + 8 * ratio;
      const beside = upright ? x0 + space < end : Math.min(x1, end) - space < left;
      ctx.textAlign = beside ? "left" : "right";
      const x = upright ? x0 : beside ? left : Math.min(x1, end);
      const above = y1 - bbox.top > 16 * ratio;
      const y = upright ? bbox.top + 12 * ratio : y1 + (above ? -6 : 14) * ratio;
      ctx.fillText(bound.text, x + (beside ? 4 : -4) * ratio, y);
    }
    ctx.restore();
  };

  // The bounds are to be seen: the vertical axis reaches them, unless that hides the signal.
  const range = (chart) => (u, low, high) => {
    if (low === null || high === null) return [0, 1];
    const side = chart.kind === "bars" ? null : chart.bounds.flatMap((b) => [b.from[1], b.to[1]]);
    for (const y of side || []) {
      if (y === null || (chart.log && y <= 0)) continue;
      const reach = high - low || Math.abs(high) || 1;
      const near = chart.log
        ? y > low / 1e4 && y < high * 1e4
        : y > low - 3 * reach && y < high + 3 * reach;
      if (near) [low, high] = [Math.min(low, y), Math.max(high, y)];
    }
    if (chart.log) {
      const one = Math.floor(Math.log10(low)), other = Math.ceil(Math.log10(high));
      return [10 ** one, 10 ** Math.max(other, one + 1)];
    }
    if (chart.kind === "bars") return [0, high * 1.1];
    return uPlot.rangeNum(low, high, 0.1, true);
  };

  const drawn = [];
  let following = false;
  const follow = (u, key) => {
    if (key !== "x" || following) return;
    following = true;
    const { min, max } = u.scales.x;
    for (const other of drawn) if (other !== u && other.linked) other.setScale("x", { min, max });
    following = false;
  };

  const lineOf = (chart, one) => {
    const stroke = () => ink(one.color);
    const base = { label: one.name || "value", value: (u, value) => short(value), spanGaps: false };
    if (chart.kind === "bars") {
      const fill = () => color("--bar");
      return { ...base, stroke: fill, fill, paths: uPlot.paths.bars({ size: [0.94, 1000] }), points: { show: false } };
    }
    if (chart.kind === "points") {
      return { ...base, stroke, paths: () => null, points: { show: true, size: 6, stroke, fill: stroke } };
    }
    return {
      ...base,
      stroke,
      width: one.desired ? 4 : 1.4,
      alpha: one.desired ? FAINT : 1,
      dash: DASHES[one.dash % DASHES.length],
      pxAlign: 0,
      points: { show: false },
    };
  };

  const ends = (values) => values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
  const rangeOfX = (chart, table) => {
    let [low, high] = ends(table[0]);
    if (chart.kind === "lines") return [low, high > low ? high : low + 1];
    for (const bound of chart.bounds) {
      const x = bound.from[0];
      if (x !== null && x > low - (high - low) && x < high + (high - low)) {
        [low, high] = [Math.min(low, x), Math.max(high, x)];
      }
    }
    const width = chart.kind === "bars" && table[0].length > 1 ? table[0][1] - table[0][0] : 0;
    const rim = width + 0.03 * (high - low) || 1;
    return [low - rim, high + rim];
  };

  for (const chart of charts) {
    const frame = document.createElement("div");
    frame.className = "chart";
    const title = document.createElement("h3");
    title.textContent = chart.title;
    if (chart.y && chart.kind === "lines") {
      const unit = document.createElement("small");
      unit.textContent = ` [${chart.y}]`;
      title.append(unit);
    }
    frame.append(title);
    area.append(frame);
    const table = joined(chart);
    const axis = {
      stroke: () => color("--faint"),
      grid: { stroke: () => color("--line"), width: 1 },
      ticks: { stroke: () => color("--line"), width: 1, size: 4 },
      font: "11px sans-serif",
      labelFont: "11px sans-serif",
      labelSize: 16,
    };
    const values = (u, splits) => splits.map(short);
    const decades = (u, splits) => splits.map((v) => (Math.abs(Math.log10(v) % 1) < 1e-9 ? v : null));
    const [first, last] = rangeOfX(chart, table);
    const options = {
      width: widthOf(frame),
      height: HEIGHT,
      scales: {
        x: { time: false, min: first, max: last, range: (u, low, high) => (low === null ? [first, last] : [low, high]) },
        y: { distr: chart.log ? 3 : 1, range: range(chart) },
      },
      series: [
        { label: chart.x, value: (u, value) => short(value) },
        ...chart.series.map((one) => lineOf(chart, one)),
      ],
      axes: [
        { ...axis, values, size: 26, ...(chart.kind === "lines" ? {} : { label: chart.x }) },
        {
          ...axis,
          ...(chart.log ? { filter: decades, grid: { ...axis.grid, filter: decades }, ticks: { ...axis.ticks, filter: decades } } : {}),
          values,
          size: 58,
          ...(chart.kind === "lines" ? {} : { label: chart.y }),
        },
      ],
      legend: { show: chart.kind !== "bars" },
      cursor: chart.kind === "lines" ? { y: false, sync: { key: "time", setSeries: false } } : { drag: { x: true, y: false } },
      hooks: { draw: [annotate(chart)], setScale: chart.kind === "lines" ? [follow] : [] },
    };
    const plot = new uPlot(options, table, frame);
    plot.linked = chart.kind === "lines";
    plot.over.addEventListener("dblclick", () => plot.setScale("x", { min: first, max: last }));
    drawn.push(plot);
  }

  const fit = () => {
    for (const plot of drawn) {
      const width = widthOf(plot.root.parentElement);
      if (width !== plot.width) plot.setSize({ width, height: HEIGHT });
    }
  };
  // In the next frame: a size that changes within a notification of sizes is an error.
  new ResizeObserver(() => requestAnimationFrame(fit)).observe(area);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const plot of drawn) plot.redraw(false, true);
  });
  document.documentElement.dataset.charts = String(drawn.length);
})();
