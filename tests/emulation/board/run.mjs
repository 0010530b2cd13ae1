// SPDX-License-Identifier: Apache-2.0
// The simplest way to try an image:  node tests/emulation/board/run.mjs IMAGE.uf2 [--ms 500] [--no-usb] [--vcd FILE] [--dma-cycles N]
// Boots it, enumerates its USB device, runs, and tells what happened.

import fs from 'node:fs';
import { parseArgs } from 'node:util';
import { levels, pinNames, statistics, vcd } from '../edges/edges.mjs';
import { Board } from './board.mjs';

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: { ms: { type: 'string', default: '100' }, 'no-usb': { type: 'boolean' }, vcd: { type: 'string' }, 'dma-cycles': { type: 'string', default: '1' } },
});

function tellDevice(device) {
  const hex = (value) => value.toString(16).padStart(4, '0');
  console.log(`usb: ${hex(device.vendor)}:${hex(device.product)} "${device.manufacturerName}" "${device.productName}" serial "${device.serial}"`);
  for (const { number, class: kind, endpoints } of device.configuration.interfaces) {
    const list = endpoints.map(({ address, type, packetSize }) => `0x${address.toString(16)}/${['control', 'iso', 'bulk', 'interrupt'][type]}/${packetSize}`);
    console.log(`  interface ${number} class ${kind.join('/')}: ${list.join(' ') || 'no endpoints'}`);
  }
}

function tellPins(recorder) {
  const gpios = [...new Set(recorder.edges.map((edge) => edge.gpio))].sort((a, b) => a - b);
  for (const gpio of gpios) {
    const edges = recorder.of(gpio);
    const { min, max } = statistics(levels(edges).map((each) => each.cycles));
    console.log(`GPIO${gpio}: ${edges.length} edges${edges.length > 1 ? `, levels of ${min} to ${max} cycles` : ''}`);
  }
}

function tell(board) {
  const { chip, host } = board;
  console.log(`time: ${(chip.nanoseconds / 1e6).toFixed(3)} ms, ${chip.scheduler.instructions} instructions, ${chip.resetCount} watchdog resets`);
  console.log(`clk_sys: ${chip.rp2040.clocks.sysFreq / 1e6} MHz${board.clockIsRight ? '' : ' (times are only right at 125)'}`);
  if (board.bootloader) console.log(`bootloader: ${board.bootloader.reason}`);
  tellPins(board.recorder);
  for (const error of host.errors) console.log(`usb error: ${error}`);
  for (const [lint, count] of host.controller.lints) console.log(`usb lint: ${lint} (${count}x)`);
  for (const [warning, count] of chip.warnings) console.log(`warning: ${warning} (${count}x)`);
  for (const [gpio, cycle] of chip.pads.contention) console.log(`contention on GPIO${gpio} from cycle ${cycle}`);
}

function main() {
  if (positionals.length !== 1) {
    console.error('usage: run.mjs IMAGE.uf2 [--ms 500] [--no-usb] [--vcd FILE] [--dma-cycles N]');
    return 2;
  }
  let board;
  try {
    board = new Board(fs.readFileSync(positionals[0]), { dmaCycles: Number(options['dma-cycles']) });
  } catch (error) {
    console.error(`error: ${error.message}`);
    return 1;
  }
  const started = process.hrtime.bigint();
  let status = 0;
  try {
    if (!options['no-usb']) tellDevice(board.connect());
    board.runMilliseconds(Number(options.ms));
  } catch (error) {
    console.error(`error: ${error.message}`);
    status = 1;
  }
  tell(board);
  console.log(`speed: ${(board.cycle / 1e6 / (Number(process.hrtime.bigint() - started) / 1e9)).toFixed(1)} MHz`);
  if (options.vcd) fs.writeFileSync(options.vcd, vcd(board.recorder.edges, pinNames(), board.recorder.initial));
  return status;
}

process.exitCode = main();
