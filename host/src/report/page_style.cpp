// SPDX-License-Identifier: Apache-2.0
#include "report/page_style.hpp"

namespace symrig::report {

const std::string_view kPageStyle = R"(
:root { color-scheme: light dark; --paper: #fcfcfa; --ink: #1d2126; --soft: #56606b; --line: #d8dade; --card: #f1f2f0;
  --rank1: #2f6fb5; --lowrank: #2a9d8f; --empty: #a9afb6; --scalar: #e0912f; --split: #ffffff; --accent: #b5452f; }
@media (prefers-color-scheme: dark) { :root { --paper: #15181c; --ink: #e6e8ea; --soft: #a3adb7; --line: #343a41;
  --card: #1e2328; --rank1: #5b9be0; --lowrank: #4cc3b2; --empty: #767d85; --scalar: #e8a450; --split: #15181c;
  --accent: #ef8a72; } }
@media print { :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444; --line: #bbb; --card: #fff;
  --rank1: #2f6fb5; --lowrank: #2a9d8f; --empty: #a9afb6; --scalar: #e0912f; --split: #fff; --accent: #b5452f; }
  figure, tr, .tile, svg { break-inside: avoid; } h2, h3 { break-after: avoid; } nav, .save, .skip { display: none; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body { margin: 0 auto; padding: 1.2rem clamp(0.9rem, 3vw, 2rem) 3rem; max-width: 76rem; background: var(--paper);
  color: var(--ink); font: 1rem/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; overflow-wrap: break-word; }
h1 { font-size: clamp(1.5rem, 4vw, 2rem); line-height: 1.2; margin: 0.2rem 0 0.3rem; }
h2 { font-size: 1.3rem; margin: 2.8rem 0 0.5rem; padding-top: 0.8rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6rem 0 0.3rem; }
p { max-width: 46rem; margin: 0.4rem 0 0.9rem; }
a { color: var(--rank1); }
a:focus-visible, summary:focus-visible, .wide:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
.skip { position: absolute; left: -100rem; } .skip:focus { position: static; }
nav { display: flex; flex-wrap: wrap; gap: 0.2rem 1.1rem; margin: 0.6rem 0 1rem; font-size: 0.95rem; }
nav a { padding: 0.2rem 0; }
.lead, figcaption, .note { color: var(--soft); }
.note { font-size: 0.9rem; }
code, pre { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.9em; }
.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(11rem, 46%), 1fr)); gap: 0.7rem;
  margin: 1.2rem 0 0.6rem; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 0.4rem; padding: 0.6rem 0.8rem; min-width: 0; }
.tile b { display: block; font-size: 1.35rem; line-height: 1.25; }
.tile span { display: block; font-size: 0.85rem; color: var(--soft); line-height: 1.35; }
.figures { display: grid; gap: 1.1rem; align-items: start; margin: 0.8rem 0 1.2rem; }
figure { margin: 0; min-width: 0; }
figure img { display: block; width: 100%; height: auto; max-height: 34rem; object-fit: contain; object-position: left;
  background: #000; border-radius: 0.2rem; image-rendering: pixelated; }
figcaption { font-size: 0.88rem; line-height: 1.4; margin-top: 0.35rem; }
.save { display: flex; flex-wrap: wrap; gap: 0.4rem; margin: 0.35rem 0 0; font-size: 0.8rem; }
.save a { border: 1px solid var(--line); border-radius: 0.3rem; padding: 0.1rem 0.55rem; background: var(--card);
  color: var(--ink); text-decoration: none; }
.save a:hover { border-color: var(--soft); }
.scale { display: flex; align-items: center; gap: 0.4rem; margin-top: 0.35rem; font-size: 0.82rem; color: var(--soft); }
.scale i { flex: 1; height: 0.7rem; border: 1px solid var(--line); print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
.scale em { flex: 1; font-style: normal; text-align: center; border: 1px solid var(--line); line-height: 1.3;
  print-color-adjust: exact; -webkit-print-color-adjust: exact; }
table { border-collapse: collapse; font-size: 0.92rem; margin: 0.4rem 0 0.6rem; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: 0.25rem 0.9rem 0.25rem 0; border-bottom: 1px solid var(--line); vertical-align: top;
  overflow-wrap: normal; }
thead th { color: var(--soft); font-weight: 600; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; }
tbody th { font-weight: normal; }
td.words, th.words { text-align: left; min-width: 16rem; }
table.facts td, table.facts th { text-align: left; font-weight: normal; }
table.facts td { overflow-wrap: break-word; }
table.facts th { color: var(--soft); padding-right: 1.2rem; }
.wide { overflow-x: auto; max-width: 100%; } .wide tbody th, .wide td { white-space: nowrap; }
.wide td.words { white-space: normal; }
@media (max-width: 40rem) { .wide table { font-size: 0.8rem; } .wide th, .wide td, .wide tbody th { white-space: normal;
  padding: 0.15rem 0.25rem 0.15rem 0; hyphens: auto; } td.words, th.words { min-width: 0; } }
pre.wide { background: var(--card); border: 1px solid var(--line); border-radius: 0.4rem; padding: 0.6rem; max-height: 30rem;
  overflow: auto; }
summary { cursor: pointer; }
svg { display: block; width: 100%; height: auto; max-width: 36rem; margin: 0.6rem 0; print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
svg text { fill: var(--ink); font: 12px system-ui, "DejaVu Sans", sans-serif; }
svg .soft { fill: var(--soft); } svg .axis { stroke: var(--line); } svg .halo { paint-order: stroke; stroke: var(--paper);
  stroke-width: 3px; }
.legend { display: flex; flex-wrap: wrap; gap: 0.2rem 1rem; font-size: 0.88rem; }
.legend i { display: inline-block; width: 0.85rem; height: 0.85rem; margin-right: 0.35rem; vertical-align: -0.1rem;
  border: 1px solid var(--line); print-color-adjust: exact; -webkit-print-color-adjust: exact; }
footer { margin-top: 3rem; border-top: 1px solid var(--line); padding-top: 0.6rem; font-size: 0.88rem; color: var(--soft); }
)";

}  // namespace symrig::report
