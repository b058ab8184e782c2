#!/usr/bin/env perl
# A painted toy duck as a coloured point cloud without normals, as a scanner would give it: the points of an implicit
# surface, evenly spread, in a binary PLY file (x y z as floats, red green blue as bytes).
#   scripts/duck_cloud.pl FILE.ply [SPACING]      metres, 0.0056: about 30,000 points
#
# The surface is a smooth blend of ellipsoids and a ring; it is 1 m long, +y is up, it looks to +x, and the origin is in the
# middle of its body. Random points are moved onto it by Newton's steps and kept unless one that was kept is nearer than the
# spacing. The same arguments give the same file.
use strict;
use warnings;

die "usage: duck_cloud.pl FILE.ply [SPACING]\n" unless @ARGV >= 1 && @ARGV <= 2;
my ($file, $spacing) = @ARGV;
$spacing //= 0.0056;
die "duck_cloud.pl: $spacing: the spacing must be a number of at least 0.002 m\n" unless $spacing =~ /^[\d.]+$/ && $spacing >= 0.002;

# name, centre, radii, turn about z in degrees
my @parts = (
  [body  => [0, 0, 0],            [0.48, 0.30, 0.34], -6],
  [tail  => [-0.42, 0.17, 0],     [0.17, 0.07, 0.13], -42],
  [head  => [0.27, 0.44, 0],      [0.23, 0.225, 0.215], 0],
  [wing  => [-0.09, 0.10, 0.29],  [0.25, 0.135, 0.09], -16],
  [wing  => [-0.09, 0.10, -0.29], [0.25, 0.135, 0.09], -16],
  [beak  => [0.51, 0.435, 0],     [0.13, 0.03, 0.105], 12],
  [beak  => [0.49, 0.390, 0],     [0.10, 0.025, 0.075], -6],
  [eye   => [0.405, 0.515, 0.135],  [0.045, 0.055, 0.045], 0],
  [eye   => [0.405, 0.515, -0.135], [0.045, 0.055, 0.045], 0],
);
$_->[4] = [cos($_->[3] * atan2(1, 1) / 45), sin($_->[3] * atan2(1, 1) / 45)] for @parts;
my %blend = (body => 0.05, tail => 0.09, head => 0.05, wing => 0.025, beak => 0.02, eye => 0.006, scarf => 0.012);

# About the distance to an ellipsoid; exact at its surface to the first order.
sub ellipsoid {
  my ($part, $x, $y, $z) = @_;
  my ($c, $r, $t) = @$part[1, 2, 4];
  my ($dx, $dy, $dz) = ($x - $c->[0], $y - $c->[1], $z - $c->[2]);
  ($dx, $dy) = ($t->[0] * $dx + $t->[1] * $dy, $t->[0] * $dy - $t->[1] * $dx);
  my ($u, $v, $w) = ($dx / $r->[0], $dy / $r->[1], $dz / $r->[2]);
  my $k = sqrt($u * $u + $v * $v + $w * $w);
  my $g = sqrt(($u / $r->[0])**2 + ($v / $r->[1])**2 + ($w / $r->[2])**2);
  return $g > 0 ? $k * ($k - 1) / $g : -$r->[1];
}

# A ring round the neck, tilted forwards.
sub scarf {
  my ($x, $y, $z) = @_;
  my ($dx, $dy) = ($x - 0.215, $y - 0.262);
  my ($c, $s) = (0.94, -0.34);
  ($dx, $dy) = ($c * $dx + $s * $dy, $c * $dy - $s * $dx);
  my $q = sqrt($dx * $dx + $z * $z) - 0.172;
  return sqrt($q * $q + ($dy * 0.8)**2) - 0.047;
}

# The blend: each part joins those before it over its own width.
sub field {
  my ($x, $y, $z) = @_;
  my $d;
  for my $part (@parts) {
    my $e = ellipsoid($part, $x, $y, $z);
    $d = defined $d ? join_smoothly($d, $e, $blend{$part->[0]}) : $e;
  }
  return join_smoothly($d, scarf($x, $y, $z), $blend{scarf});
}

sub join_smoothly {
  my ($a, $b, $width) = @_;
  my $h = $width - abs($a - $b);
  my $least = $a < $b ? $a : $b;
  return $h > 0 ? $least - $h * $h / (4 * $width) : $least;
}

# Onto the surface, or nothing.
sub settle {
  my @p = @_;
  my $h = 1e-4;
  for (1 .. 6) {
    my $f = field(@p);
    return @p if abs($f) < 2e-6;
    return if abs($f) > 0.15;
    my @g = map { my @q = @p; $q[$_] += $h; (field(@q) - $f) / $h } 0 .. 2;
    my $square = $g[0]**2 + $g[1]**2 + $g[2]**2;
    return if $square < 1e-6;
    $p[$_] -= $f * $g[$_] / $square for 0 .. 2;
  }
  return abs(field(@p)) < 1e-5 ? @p : ();
}

sub mix { my ($a, $b, $t) = @_; $t = $t < 0 ? 0 : $t > 1 ? 1 : $t; return map { $a->[$_] + $t * ($b->[$_] - $a->[$_]) } 0 .. 2; }

# The paint, sRGB 0 to 255.
sub paint {
  my ($x, $y, $z) = @_;
  my $yellow = [250, 200, 40];
  return (24, 22, 26) if ellipsoid($parts[7], $x, $y, $z) < 0.008 && !glint($x, $y, $z, $z > 0) && $z > 0;
  return (24, 22, 26) if ellipsoid($parts[8], $x, $y, $z) < 0.008 && !glint($x, $y, $z, 0) && $z < 0;
  return (250, 250, 250) if $y > 0.5 && $x > 0.38 && glint($x, $y, $z, $z > 0);
  if (scarf($x, $y, $z) < 0.006) {
    # White dots in two rows on red.
    my $turn = atan2($z, $x - 0.215) / (8 * atan2(1, 1)) * 18;
    my $row = ($y - 0.262 + 0.36 * ($x - 0.215)) / 0.05;
    my $shift = $row > 0 ? 0.5 : 0;
    my ($a, $b) = ($turn + $shift - floor($turn + $shift) - 0.5, ($row > 0 ? $row - 0.45 : $row + 0.45));
    return sqrt(($a * 0.06)**2 + ($b * 0.05)**2) < 0.0125 ? (245, 240, 235) : (200, 28, 40);
  }
  if (ellipsoid($parts[5], $x, $y, $z) < 0.012 || ellipsoid($parts[6], $x, $y, $z) < 0.012) {
    return mix([235, 95, 20], [250, 140, 35], ($y - 0.38) / 0.08);
  }
  my $wing = ellipsoid($parts[$z > 0 ? 3 : 4], $x, $y, $z);
  if ($wing < 0.012) {
    # Feathers: rows of scales that get darker backwards.
    my ($u, $v) = (($x + 0.34) / 0.085, ($y + 0.02 - 0.28 * $x) / 0.055);
    my $row = floor($v);
    my ($a, $b) = ($u + 0.5 * ($row % 2), $v - $row);
    $a = $a - floor($a) - 0.5;
    my $rim = sqrt($a * $a * 1.1 + (1 - $b)**2 * 0.35);
    return mix([236, 150, 20], [252, 218, 110], $rim < 0.4 ? 1 : ($rim < 0.5 ? (0.5 - $rim) / 0.1 : 0)) if $wing < 0.004 || $rim < 0.5;
    return (236, 150, 20);
  }
  # Paler breast, warmer back.
  return mix($yellow, [255, 224, 120], ($x - 0.25 - 0.5 * $y) / 0.3) if $y < 0.2;
  return @$yellow;
}

# The light spot on an eye.
sub glint {
  my ($x, $y, $z, $left) = @_;
  my $side = $z > 0 ? 1 : -1;
  return ($x - 0.437)**2 + ($y - 0.542)**2 + ($z - $side * 0.157)**2 < 0.014**2;
}

sub floor { my $i = int($_[0]); return $i > $_[0] ? $i - 1 : $i; }

# The linear congruential generator of Numerical Recipes, 32 bits: the same everywhere.
my $state = 12345;
sub chance { $state = ($state * 1664525 + 1013904223) & 0xffffffff; return ($state >> 8) / 16777216; }

my (%cells, @points);
my $misses = 0;
while ($misses < 60000) {
  my @p = settle(-0.62 + 1.28 * chance(), -0.34 + 1.06 * chance(), -0.42 + 0.84 * chance());
  next unless @p;
  my @cell = map { floor($_ / $spacing) } @p;
  my $free = 1;
  NEAR: for my $i (-1 .. 1) { for my $j (-1 .. 1) { for my $k (-1 .. 1) {
    my $others = $cells{($cell[0] + $i) . ',' . ($cell[1] + $j) . ',' . ($cell[2] + $k)} or next;
    for my $o (@$others) {
      next if ($o->[0] - $p[0])**2 + ($o->[1] - $p[1])**2 + ($o->[2] - $p[2])**2 >= $spacing**2;
      $free = 0;
      last NEAR;
    }
  } } }
  if (!$free) { ++$misses; next; }
  push @{ $cells{join ',', @cell} }, \@p;
  push @points, \@p;
}

open my $out, '>:raw', $file or die "duck_cloud.pl: $file: $!\n";
print $out "ply\nformat binary_little_endian 1.0\nelement vertex " . @points . "\n",
  map({ "property float $_\n" } qw(x y z)), map({ "property uchar $_\n" } qw(red green blue)), "end_header\n";
print $out pack('f<3C3', @$_, map { int($_ + 0.5) } paint(@$_)) for @points;
close $out or die "duck_cloud.pl: $file: $!\n";
print scalar(@points), " points\n";
