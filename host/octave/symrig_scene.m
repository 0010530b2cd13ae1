% SPDX-License-Identifier: Apache-2.0
function scene = symrig_scene (file, camera, projector)
% SYMRIG_SCENE  Light transport that symrig has captured: photograph = T * light.
%
%   scene = symrig_scene ("scene.h5")
%   scene = symrig_scene ("scene.h5", [rows cols])               for a file without held-out photographs
%   scene = symrig_scene ("scene.h5", [rows cols], [rows cols])  camera and projector of different size
%
%   scene.relight (light)   the photograph under a light: [rows cols], or [rows cols channels] in colour
%   scene.dual (light)      what the projector sees while the camera's pixels shine: T' * light
%   scene.camera, scene.projector   [rows cols]
%   scene.channels          1 or 3
%   scene.symmetric         true: T = T'
%   scene.held_out          photographs that test T: (k).pattern and (k).photograph
%   scene.own               T on the camera's own pixels, or [] if the file has none:
%     scene.own.camera          [rows cols]
%     scene.own.relight (light) the photograph. Of a camera with a colour mosaic, each pixel has light in the
%                               channel of its own filter only
%
%   A light has the projector's size (for dual: the camera's), and one value for each pixel: linear, 1 is
%   white. Sums are double; the numbers of the file have 11 bits (docs/file-format.md).
%   Octave reads no attributes of HDF5, so the size comes from a held-out photograph, or is given.

  raw = read_groups (file);
  s = parts_of (raw);
  s.held_out = held_out_of (raw);
  if (nargin < 2)
    if (isempty (s.held_out))
      error ('symrig_scene: %s has no held-out photograph; give its size: symrig_scene (file, [rows cols])', file);
    end
    camera = size (s.held_out(1).photograph(:, :, 1));
    projector = size (s.held_out(1).pattern);
  elseif (nargin < 3)
    projector = camera;
  end
  if (prod (camera) ~= numel (s.camera_order) || prod (projector) ~= numel (s.projector_order))
    error ('symrig_scene: %s has %d camera and %d projector pixels; the given size has %d and %d', file, ...
           numel (s.camera_order), numel (s.projector_order), prod (camera), prod (projector));
  end
  s.camera = camera;
  s.projector = projector;
  scene = struct ('camera', camera, 'projector', projector, 'channels', s.channels, 'symmetric', s.symmetric, ...
                  'held_out', s.held_out, 'own', own_of (raw, s), 'relight', @(light) apply (s, light, false), ...
                  'dual', @(light) apply (s, light, true));
end

function raw = read_groups (file)
% All data sets as a struct of structs. Their dimensions come in reverse order, as in any program that stores
% column after column.
  if (exist ('OCTAVE_VERSION', 'builtin'))
    raw = load ('-hdf5', file);
  else
    raw = read_group (h5info (file), file);
  end
  if (~isfield (raw, 'leaves') || ~isfield (raw, 'camera_order'))
    error ('symrig_scene: %s is no scene of symrig', file);
  end
end

function out = read_group (info, file)
% MATLAB's way. Names that are numbers get a _ in front, as Octave gives them.
  out = struct ();
  for k = 1:numel (info.Datasets)
    out.(info.Datasets(k).Name) = h5read (file, [info.Name '/' info.Datasets(k).Name]);
  end
  for k = 1:numel (info.Groups)
    parts = strsplit (info.Groups(k).Name, '/');
    name = parts{end};
    if (name(1) >= '0' && name(1) <= '9')
      name = ['_' name];
    end
    out.(strrep (name, '_', 'g_')) = read_group (info.Groups(k), file);
  end
end

function s = parts_of (raw)
% The parts of T as doubles, with their powers of two applied.
  s.camera_order = double (raw.camera_order(:)) + 1;
  s.projector_order = double (raw.projector_order(:)) + 1;
  % Only a symmetric file has direct light apart, and every captured one has some.
  s.symmetric = isfield (raw, 'diagonal') && ~isempty (raw.diagonal.at);
  s.channels = size (raw.columns.values, 1);
  channels = s.channels;
  s.range = reshape (double (raw.leaves.range), 4, []);
  s.rank = double (raw.leaves.rank(:));
  s.exponents = double (raw.leaves.exponents(:));
  s.factors = double (raw.leaves.factors(:));
  at = reshape (double (raw.scalars.at), 2, []) + 1;
  s.rows = at(1, :)';
  s.cols = at(2, :)';
  powers = 2 .^ double (raw.scalars.exponents(:))';
  s.values = reshape (double (raw.scalars.values), [], channels) .* powers;
  s.diagonal_at = zeros (0, 1);
  s.diagonal = zeros (0, channels);
  if (s.symmetric)
    s.diagonal_at = double (raw.diagonal.at(:)) + 1;
    s.diagonal = reshape (double (raw.diagonal.values), channels, [])';
  end
  s.first = double (raw.columns.first(:));
  s.column_range = reshape (double (raw.columns.range), 2, []);
  s.column_rows = double (raw.columns.rows(:)) + 1;
  s.column_values = reshape (double (raw.columns.values), channels, [])';
  s.bands = bands_of (raw, channels);
end

function bands = bands_of (raw, channels)
% Each band: its radius, and values [pixel in raster order, offset, channel].
  bands = struct ('radius', {}, 'values', {});
  if (~isfield (raw, 'bands') || ~isstruct (raw.bands))
    return;
  end
  names = fieldnames (raw.bands);
  for k = 1:numel (names)
    band = raw.bands.(names{k});
    powers = 2 .^ double (band.exponents);       % [offset, channel]
    offsets = numel (powers) / channels;
    radius = (sqrt (1 + 2 * offsets) - 1) / 2;   % R + R (2 R + 1) offsets
    values = reshape (double (band.values), [], offsets, channels);
    values = values .* reshape (powers, 1, offsets, channels);
    bands(end + 1) = struct ('radius', round (radius), 'values', values);
  end
end

function held_out = held_out_of (raw)
  held_out = struct ('pattern', {}, 'photograph', {});
  if (~isfield (raw, 'held_out') || ~isstruct (raw.held_out))
    return;
  end
  names = fieldnames (raw.held_out);
  for k = 1:numel (names)
    one = raw.held_out.(names{k});
    held_out(end + 1) = struct ('pattern', double (one.pattern)', ...
                                'photograph', permute (double (one.photograph), [2 1 3]));
  end
end

function out = apply (s, light, dual)
  if (dual)
    in = s.camera; to = s.projector; in_order = s.camera_order; to_order = s.projector_order;
  else
    in = s.projector; to = s.camera; in_order = s.projector_order; to_order = s.camera_order;
  end
  if (~isequal (size (light), in))
    error ('symrig_scene: the light is %s, the scene''s side has %s', mat2str (size (light)), mat2str (in));
  end
  raster = double (light)';                      % now raster order runs down the column
  raster = raster(:);
  out = zeros ([to s.channels]);
  for channel = 1:s.channels
    y = zeros (numel (to_order), 1);
    y = add_leaves (y, s, raster(in_order), channel, dual);
    y = add_entries (y, s, raster(in_order), channel, dual);
    y = add_columns (y, s, raster(in_order), channel, dual);
    picture = zeros (numel (to_order), 1);
    picture(to_order) = y;
    picture = add_bands (picture, s, raster, channel);
    out(:, :, channel) = reshape (picture, to(2), to(1))';
  end
end

function y = add_leaves (y, s, p, channel, dual)
% T(rows, cols) = A B'. The mirror image of a leaf off the diagonal belongs to a symmetric T too.
  at = 0; e = 0;
  for k = 1:numel (s.rank)
    rank = s.rank(k); r = s.range(1, k) + 1:s.range(2, k); c = s.range(3, k) + 1:s.range(4, k);
    skip = (channel - 1) * rank * (numel (r) + numel (c));
    a = reshape (s.factors(at + skip + (1:rank * numel (r))), numel (r), rank);
    b = reshape (s.factors(at + skip + rank * numel (r) + (1:rank * numel (c))), numel (c), rank);
    powers = 2 .^ s.exponents(e + (channel - 1) * 2 * rank + (1:2 * rank));
    a = a .* powers(1:rank)';
    b = b .* powers(rank + 1:end)';
    mirrored = s.symmetric && r(1) ~= c(1);
    if (~dual || mirrored)
      y(r) = y(r) + a * (b' * p(c));
    end
    if (dual || mirrored)
      y(c) = y(c) + b * (a' * p(r));
    end
    at = at + s.channels * rank * (numel (r) + numel (c));
    e = e + s.channels * 2 * rank;
  end
end

function y = add_entries (y, s, p, channel, dual)
  if (~isempty (s.diagonal_at))
    y(s.diagonal_at) = y(s.diagonal_at) + s.diagonal(:, channel) .* p(s.diagonal_at);
  end
  if (isempty (s.rows))
    return;
  end
  v = s.values(:, channel);
  if (~dual || s.symmetric)
    y = y + accumarray (s.rows, v .* p(s.cols), size (y));
  end
  if (dual || s.symmetric)
    y = y + accumarray (s.cols, v .* p(s.rows), size (y));
  end
end

function y = add_columns (y, s, p, channel, dual)
  for k = 1:size (s.column_range, 2)
    entries = s.first(k) + 1:s.first(k + 1);
    c = s.column_range(1, k) + 1:s.column_range(2, k);
    rows = s.column_rows(entries);
    v = s.column_values(entries, channel);
    if (dual)
      y(c) = y(c) + sum (v .* p(rows));
    else
      y(rows) = y(rows) + v * sum (p(c));
    end
  end
end

function picture = add_bands (picture, s, raster, channel)
% T(i, i + d) for each offset d; only a symmetric T has bands.
  cols = s.camera(2); rows = s.camera(1);
  for k = 1:numel (s.bands)
    radius = s.bands(k).radius;
    offset = 0;
    for dy = 0:radius
      for dx = -radius:radius
        if (dy == 0 && dx < 1)
          continue;
        end
        offset = offset + 1;
        t = reshape (s.bands(k).values(:, offset, channel), cols, rows);
        from = false (cols, rows);
        from(max (1, 1 - dx):min (cols, cols - dx), 1:rows - dy) = true;
        i = find (from);
        j = i + dy * cols + dx;
        picture(i) = picture(i) + t(i) .* raster(j);
        picture(j) = picture(j) + t(i) .* raster(i);
      end
    end
  end
end

function own = own_of (raw, s)
% T on the camera's own pixels (docs/file-format.md, Camera pixels).
  own = [];
  if (~isfield (raw, 'camera') || ~isstruct (raw.camera))
    return;
  end
  if (~isfield (raw.camera, 'size'))
    warning ('symrig_scene: the file does not tell the size of the camera''s own pixels; capture again');
    return;
  end
  c = raw.camera;
  c.size = double (c.size(:))';
  c.bases = double (reshape (c.bases, 3, []))';
  c.groups = double (reshape (c.groups, 3, []))';
  for name = {'basis_values', 'columns', 'middles', 'steps', 'pixels', 'brightness', 'codes'}
    c.(name{1}) = double (c.(name{1})(:));
  end
  own = struct ('camera', c.size, 'relight', @(light) apply_own (c, s, light));
end

function out = apply_own (c, s, light)
  if (~isequal (size (light), s.projector))
    error ('symrig_scene: the light is %s, the scene has %s', mat2str (size (light)), mat2str (s.projector));
  end
  raster = double (light)';                      % now raster order runs down the column
  raster = raster(:);
  tree = raster(s.projector_order);
  shown = zeros (sum (c.bases(:, 3)), 1);        % what the light shows to each column of the bases
  value = 0; k = 0;
  for b = 1:size (c.bases, 1)
    cells = c.bases(b, 1) + 1:c.bases(b, 2); rank = c.bases(b, 3);
    v = reshape (c.basis_values(value + (1:numel (cells) * rank)), numel (cells), rank);
    shown(k + (1:rank)) = v' * tree(cells);
    value = value + numel (cells) * rank; k = k + rank;
  end
  lit = [raster; shown];                         % cells, then columns
  at = c.columns + 1 + numel (raster);           % k >= 0: column k; -1 - n: cell n
  at(c.columns < 0) = -c.columns(c.columns < 0);
  x = lit(at);
  out = zeros ([c.size(2), c.size(1), s.channels]);
  column = 0; pixel = 0; code = 0;
  for g = 1:size (c.groups, 1)
    columns = column + (1:c.groups(g, 2)); pixels = pixel + (1:c.groups(g, 3));
    codes = reshape (c.codes(code + (1:numel (columns) * numel (pixels))), numel (columns), numel (pixels));
    a = c.middles(columns) + c.steps(columns) .* codes;
    at = c.groups(g, 1) * prod (c.size) + c.pixels(pixels) + 1;
    out(at) = c.brightness(pixels) .* (a' * x(columns));
    column = column + numel (columns); pixel = pixel + numel (pixels);
    code = code + numel (columns) * numel (pixels);
  end
  out = permute (out, [2 1 3]);
end
