// Drag over a chart to zoom in; a double click or "whole drive" shows the whole chart again; a name in
// the legend hides its curve. On the keyboard, + and - zoom, arrows move, Escape shows the whole chart.
// Charts over time move together. The pointer reads each curve: at its time, on a map the nearest point.
'use strict';
(() => {
  const SIDE = 10000, AIR = 0.06, LEAST = SIDE / 500;
  // For each key: the factor of the view's width, and the shares of the width by which the view moves right and down.
  const KEYS = {
    '+': [0.5, 0, 0], '=': [0.5, 0, 0], '-': [2, 0, 0],
    ArrowLeft: [1, -0.25, 0], ArrowRight: [1, 0.25, 0], ArrowUp: [1, 0, -0.25], ArrowDown: [1, 0, 0.25],
  };
  const charts = [...document.querySelectorAll('.chart')].map(figure => {
    const svg = figure.querySelector('svg'), plot = figure.querySelector('.plot');
    const [x0, x1, y0, y1] = figure.dataset.range.split(' ').map(Number);
    const curves = [...svg.children].map(line => ({
      line, free: line.classList.contains('free'),
      name: figure.querySelector(`.key.${line.classList[0]}`).firstChild.textContent.trim(),
      points: line.getAttribute('points').split(' ').map(pair => pair.split(',').map(Number)),
    }));
    return { figure, svg, plot, curves, x0, x1, y0, y1, view: [0, SIDE, 0, SIDE],
      isMap: figure.classList.contains('map') };
  });

  const ticks = (from, to, most) => {
    const rough = (to - from) / most, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(k => k * power).find(step => step >= rough);
    const decimals = Math.max(0, -Math.floor(Math.log10(step * 1.001)));
    const all = [];
    for (let k = Math.ceil(from / step); k <= Math.floor(to / step); k++) {
      all.push([k * step, (k * step + 0).toFixed(decimals)]);
    }
    return all;
  };
  const axis = (box, side, from, to, most) => box.replaceChildren(...ticks(from, to, most).map(([at, text]) => {
    const line = document.createElement('i'), label = document.createElement('b');
    line.style[side] = 100 * (at - from) / (to - from) + '%';
    label.textContent = text;
    line.append(label);
    return line;
  }));

  // Fits the vertical range to the visible part of the curves.
  const fit = chart => {
    const [left, right] = chart.view;
    let top = Infinity, bottom = -Infinity;
    for (const { line, free, points } of chart.curves) {
      if (free || line.classList.contains('hidden')) continue;
      for (const [x, y] of points) {
        if (x >= left && x <= right) { top = Math.min(top, y); bottom = Math.max(bottom, y); }
      }
    }
    if (top > bottom) return;
    const air = AIR * (bottom - top) + 1;
    chart.view = [left, right, top - air, bottom + air];
  };
  const draw = chart => {
    const [left, right, top, bottom] = chart.view;
    const { svg, plot, x0, x1, y0, y1 } = chart;
    svg.setAttribute('viewBox', `${left} ${top} ${right - left} ${bottom - top}`);
    const x = at => x0 + at / SIDE * (x1 - x0), y = at => y1 - at / SIDE * (y1 - y0);
    axis(plot.querySelector('.x'), 'left', x(left), x(right), 9);
    axis(plot.querySelector('.y'), 'bottom', y(bottom), y(top), 6);
    chart.whole.classList.toggle('hidden', left <= 0 && right >= SIDE);
  };
  const show = (chart, view) => {
    if (chart.isMap) { chart.view = view; return draw(chart); }
    for (const other of charts.filter(chart => !chart.isMap)) {
      other.view = [view[0], view[1], 0, SIDE];
      if (view[0] > 0 || view[1] < SIDE) fit(other);
      draw(other);
    }
  };

  for (const chart of charts) {
    const { figure, plot } = chart;
    figure.classList.add('zooms');
    chart.whole = Object.assign(document.createElement('button'), { type: 'button', className: 'whole hidden', textContent: 'whole drive' });
    figure.querySelector('figcaption').append(chart.whole);
    const back = () => show(chart, [0, SIDE, 0, SIDE]);
    chart.whole.onclick = back;
    plot.ondblclick = back;
    for (const key of figure.querySelectorAll('.key')) {
      key.onclick = () => {
        const shown = key.getAttribute('aria-pressed') !== 'true';
        key.setAttribute('aria-pressed', shown);
        for (const { line } of chart.curves) {
          if (line.classList.contains(key.dataset.curve)) line.classList.toggle('hidden', !shown);
        }
      };
    }
    plot.tabIndex = 0;
    plot.setAttribute('role', 'group');
    plot.setAttribute('aria-label', `${chart.svg.getAttribute('aria-label')}: + and - zoom, arrows move, Escape goes back`);
    plot.onkeydown = event => {
      if (event.key === 'Escape') return back();
      const [by, across, down] = KEYS[event.key] ?? [];
      if (!by || event.ctrlKey || event.metaKey || event.altKey || (down && !chart.isMap)) return;
      event.preventDefault();
      const [left, right, top, bottom] = chart.view, side = Math.max(LEAST, by * (right - left));
      if (side >= SIDE) return back();
      const start = (middle, share) => Math.min(SIDE - side, Math.max(0, middle + (share - 0.5) * side));
      const [x, y] = [start((left + right) / 2, across), start((top + bottom) / 2, down)];
      show(chart, [x, x + side, y, y + side]);
    };
    const tip = Object.assign(document.createElement('div'), { className: 'tip hidden' });
    const mark = Object.assign(document.createElement('div'), { className: 'mark hidden' });
    plot.append(mark, tip);
    const [unit] = figure.querySelector('figcaption span').textContent.split(',');
    const figures = (from, to) => Math.max(0, 4 - Math.ceil(Math.log10((to - from) * 1.001)));
    const hush = () => [tip, mark].forEach(part => part.classList.add('hidden'));
    const read = event => {
      const [left, right, top, bottom] = chart.view, { x0, x1, y0, y1 } = chart, [u, v] = at(event);
      const [x, y] = [left + u * (right - left), top + v * (bottom - top)];
      const far = ([a, b]) => chart.isMap ? Math.hypot((a - x) * (x1 - x0), (b - y) * (y1 - y0)) : Math.abs(a - x);
      const value = (at, from, to) => (from + at / SIDE * (to - from)).toFixed(figures(from, to));
      const rows = chart.curves.filter(({ line }) => !line.classList.contains('hidden')).map(({ line, name, points }) => {
        const [a, b] = points.reduce((near, point) => far(point) < far(near) ? point : near);
        const row = Object.assign(document.createElement('div'), { className: `key ${line.classList[0]}` });
        // A point that far out was moved to the edge when the page was written.
        const height = b <= -9 * SIDE || b >= 10 * SIDE ? 'outside' : value(SIDE - b, y0, y1);
        row.textContent = `${name} ${chart.isMap ? value(a, x0, x1) + ', ' : ''}${height}`;
        return row;
      });
      const head = document.createElement('div');
      head.textContent = chart.isMap ? `across, up, ${unit}` : `${value(x, x0, x1)} s: ${unit}`;
      tip.replaceChildren(head, ...rows);
      tip.style.cssText = u < 0.5 ? 'right:.4rem' : 'left:.4rem';
      mark.style.left = 100 * u + '%';
      tip.classList.remove('hidden');
      mark.classList.toggle('hidden', chart.isMap);
    };
    plot.onpointerleave = hush;
    let from = null, brush = null;
    const at = event => {
      const box = plot.getBoundingClientRect();
      const clamp = value => Math.min(1, Math.max(0, value));
      return [clamp((event.clientX - box.left) / box.width), clamp((event.clientY - box.top) / box.height)];
    };
    const span = (a, b) => {
      let [[u0, u1], [v0, v1]] = [0, 1].map(k => [Math.min(a[k], b[k]), Math.max(a[k], b[k])]);
      if (!chart.isMap) [v0, v1] = [0, 1];
      return [u0, u1, v0, v1];
    };
    plot.onpointerdown = event => {
      if (event.button) return;
      from = at(event);
      brush = Object.assign(document.createElement('div'), { className: 'brush' });
      plot.append(brush);
      plot.setPointerCapture(event.pointerId);
    };
    plot.onpointermove = event => {
      if (!from) return read(event);
      hush();
      const [u0, u1, v0, v1] = span(from, at(event)).map(part => 100 * part);
      brush.style.cssText = `left:${u0}%;width:${u1 - u0}%;top:${v0}%;height:${v1 - v0}%`;
    };
    const end = event => {
      if (!from) return;
      const [u0, u1, v0, v1] = span(from, at(event));
      from = null;
      brush.remove();
      if (event.type !== 'pointerup') return;
      if (u1 - u0 < 0.01) return read(event);
      const [left, right, top, bottom] = chart.view, width = right - left, height = bottom - top;
      let view = [left + u0 * width, left + u1 * width, top + v0 * height, top + v1 * height];
      if (chart.isMap) {
        // Both axes of a map keep the same scale.
        const half = Math.max(view[1] - view[0], view[3] - view[2], LEAST) / 2;
        const [x, y] = [(view[0] + view[1]) / 2, (view[2] + view[3]) / 2];
        view = [x - half, x + half, y - half, y + half];
      }
      if (view[1] - view[0] >= LEAST) show(chart, view);
    };
    plot.onpointerup = end;
    plot.onpointercancel = end;
  }
})();
