// SPDX-License-Identifier: Apache-2.0
// node make_uf2.mjs IMAGE.raw IMAGE.uf2: gives the second stage its CRC and packs the image.

import fs from 'node:fs';
import { sealBoot2, writeUf2 } from '../board/image.mjs';

const [raw, uf2] = process.argv.slice(2);
fs.writeFileSync(uf2, writeUf2(sealBoot2(fs.readFileSync(raw))));
