// Draws the embedded histories as zoomable charts in place of the static pictures; charts of one record move together.
(() => {
  "use strict";
  const records = JSON.parse(document.getElementById("histories").textContent);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const strokes = { variant0: "before", variant1: "after" };
  const stroke = (name) => colour(strokes[name] || name);
  const GAP = -32768;

  const decode = (series) => {
    const bytes = Uint8Array.from(atob(series.data), (character) => character.charCodeAt(0));
    const integers = new DataView(bytes.buffer);
    return Array.from({ length: bytes.length / 2 }, (_, index) => {
      const integer = integers.getInt16(2 * index, true);
      return integer === GAP ? null : series.offset + series.scale * integer;
    });
  };
  const instants = (time) =>
    time.values || Array.from({ length: time.count }, (_, index) => time.start + index * time.step);
  const digits = (value) => (value == null ? "" : Number(value.toPrecision(5)).toString());

  const options = (record, channel, series, place, residual) => {
    const axis = (label, extra) => Object.assign({
      label, stroke: colour("soft"), font: "12px system-ui", labelFont: "12px system-ui", labelSize: label ? 20 : 0, labelGap: 0,
      grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("line"), width: 1, size: 5 },
    }, extra);
    return {
      width: place.clientWidth, height: residual ? 160 : 230,
      legend: {
        show: !residual,
        markers: { width: 0, fill: (_, index) => (index > 0 ? stroke(series[index - 1].class) : "transparent") },
        mount: (_, legend) => place.prepend(legend),
      },
      cursor: { sync: { key: record.key, setSeries: false }, drag: { x: true, y: false }, y: false },
      scales: { x: { time: false } },
      axes: [
        residual ? axis("time [s]", { size: 24 }) : axis(null, { size: 6, values: (_, ticks) => ticks.map(() => "") }),
        axis(residual ? `residual [${channel.unit}]` : channel.label, { size: 46, space: residual ? 20 : 30 }),
      ],
      series: [{ label: "time [s]", value: (_, value) => digits(value) }].concat(series.map((one) => ({
        label: one.name, stroke: stroke(one.class), width: one.class === "measured" ? 1.4 : 1,
        points: { show: false }, value: (_, value) => digits(value),
      }))),
      hooks: { setScale: [(chart, key) => key === "x" && follow(record, chart)] },
    };
  };

  const follow = (record, leader) => {
    if (record.following) return;
    record.following = true;
    const { min, max } = leader.scales.x;
    record.charts.forEach((chart) => chart !== leader && chart.setScale("x", { min, max }));
    record.following = false;
  };

  const draw = () => {
    for (const [index, record] of records.entries()) {
      (record.charts || []).forEach((chart) => chart.destroy());
      record.key = "record" + index;
      record.charts = [];
      record.following = true; // until every chart of the record exists
      const x = instants(record.time);
      for (const channel of record.channels) {
        const place = document.getElementById(channel.id);
        if (!place || place.clientWidth === 0) continue; // folded away: drawn when unfolded
        for (const [series, residual] of [[channel.curves, false], [channel.residuals, true]]) {
          series.forEach((one) => (one.values = one.values || decode(one)));
          const data = [x].concat(series.map((one) => one.values));
          record.charts.push(new uPlot(options(record, channel, series, place, residual), data, place));
        }
      }
      record.following = false;
    }
  };

  document.documentElement.classList.add("scripted");
  draw();
  let pending = 0;
  const later = () => { clearTimeout(pending); pending = setTimeout(draw, 150); };
  window.addEventListener("resize", later);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", later);
  document.querySelectorAll("details.record").forEach((details) => details.addEventListener("toggle", later));

  const button = document.getElementById("copy");
  if (button && navigator.clipboard) {
    button.hidden = false;
    button.addEventListener("click", async () => {
      await navigator.clipboard.writeText(document.getElementById("extension").textContent);
      button.textContent = "copied";
      setTimeout(() => (button.textContent = "copy"), 1500);
    });
  }
})();
