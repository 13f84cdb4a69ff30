"""What a robot knows about itself and hands to its clients: a URDF, or a compiled library.

An FR3 serves its model as URDF. A Panda serves a shared library with 30 functions; this one is
compiled from the text below with the machine's C compiler. It knows kinematics, which is all that
an impedance controller needs; mass and Coriolis terms are zero, for the arm moves slowly.
"""

from __future__ import annotations

import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

from shearline.sims.panda import FLANGE_M, LINKS, Link, link_offset

#: What compiles the library of a Panda, or ``None`` where there is no compiler.
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")

_C = """
#include <math.h>
#include <string.h>
static const double A[8] = {@A@}, D[8] = {@D@}, ALPHA[8] = {@ALPHA@};
static void product(double *t, const double *a) {
  double r[16];
  for (int i = 0; i < 4; i++) for (int j = 0; j < 4; j++) {
    r[4*j+i] = 0; for (int k = 0; k < 4; k++) r[4*j+i] += t[4*k+i] * a[4*j+k]; }
  memcpy(t, r, sizeof r); }
static void joint(double *t, int i, double q) {
  double c = cos(q), s = sin(q), ca = cos(ALPHA[i]), sa = sin(ALPHA[i]);
  double a[16] = {c, s*ca, s*sa, 0, -s, c*ca, c*sa, 0, 0, -sa, ca, 0, A[i], -sa*D[i], ca*D[i], 1};
  product(t, a); }
static void pose(int frame, const double *q, const double *ee, double *t, double axes[7][6]) {
  memset(t, 0, 16 * sizeof *t); t[0] = t[5] = t[10] = t[15] = 1;
  for (int i = 0; i < 7 && i < frame; i++) {
    joint(t, i, q[i]);
    if (axes) { memcpy(axes[i], t + 8, 24); memcpy(axes[i] + 3, t + 12, 24); } }
  if (frame > 7) joint(t, 7, 0);
  if (frame > 8) product(t, ee); }
static void jacobian(int frame, const double *q, const double *ee, double *j, int body) {
  double t[16], axes[7][6], c[6];
  pose(frame, q, ee, t, axes); memset(j, 0, 42 * sizeof *j);
  for (int i = 0; i < 7 && i < frame; i++) {
    double *z = axes[i], r[3] = {t[12] - z[3], t[13] - z[4], t[14] - z[5]};
    double v[6] = {z[1]*r[2]-z[2]*r[1], z[2]*r[0]-z[0]*r[2], z[0]*r[1]-z[1]*r[0], z[0], z[1], z[2]};
    if (body) for (int h = 0; h < 6; h += 3) for (int k = 0; k < 3; k++)
      c[h+k] = t[4*k]*v[h] + t[4*k+1]*v[h+1] + t[4*k+2]*v[h+2];
    memcpy(j + 6*i, body ? c : v, sizeof c); } }
#define JOINT(n) void O_T_J##n(const double *q, double *t) { pose(n, q, 0, t, 0); }
#define JACOBIANS(n) void O_J_J##n(const double *q, double *j) { jacobian(n, q, 0, j, 0); } \\
                     void Ji_J_J##n(const double *q, double *j) { jacobian(n, q, 0, j, 1); }
JOINT(1) JOINT(2) JOINT(3) JOINT(4) JOINT(5) JOINT(6) JOINT(7) JOINT(8)
JACOBIANS(2) JACOBIANS(3) JACOBIANS(4) JACOBIANS(5) JACOBIANS(6) JACOBIANS(7) JACOBIANS(8)
static const double home[7];
void O_J_J1(double *j) { jacobian(1, home, 0, j, 0); }
void Ji_J_J1(double *j) { jacobian(1, home, 0, j, 1); }
void O_T_J9(const double *q, const double *ee, double *t) { pose(9, q, ee, t, 0); }
void O_J_J9(const double *q, const double *ee, double *j) { jacobian(9, q, ee, j, 0); }
void Ji_J_J9(const double *q, const double *ee, double *j) { jacobian(9, q, ee, j, 1); }
void M_NE(const double *q, const double *i, double m, const double *x, double *mass) {
  memset(mass, 0, 49 * sizeof *mass); for (int k = 0; k < 7; k++) mass[8*k] = 1; }
void c_NE(const double *q, const double *dq, const double *i, double m, const double *x,
          double *c) { memset(c, 0, 7 * sizeof *c); }
void g_NE(const double *q, const double *g, double m, const double *x, double *tau) {
  memset(tau, 0, 7 * sizeof *tau); }
"""


@functools.cache
def library() -> bytes:
    """Compile the library that a Panda hands out; once, for all who ask.

    Raises:
        RuntimeError: If this machine has no C compiler.
    """
    if COMPILER is None:
        raise RuntimeError("a Panda's model library needs a C compiler: install gcc")
    numbers = {
        "@A@": [link.a for link in LINKS] + [0.0],
        "@D@": [link.d for link in LINKS] + [FLANGE_M],
        "@ALPHA@": [link.alpha for link in LINKS] + [0.0],
    }
    text = _C
    for name, values in numbers.items():
        text = text.replace(name, ", ".join(repr(value) for value in values))
    with tempfile.TemporaryDirectory() as folder:
        source, built = Path(folder, "model.c"), Path(folder, "model.so")
        source.write_text(text)
        flags = ["-O2", "-fPIC", "-shared", "-o", str(built), str(source), "-lm"]
        subprocess.run([COMPILER, *flags], check=True)
        return built.read_bytes()


def urdf() -> str:
    """Return the arm as URDF, as an FR3 serves it."""
    parts = ['<robot name="fr3"><link name="fr3_link0"/>']
    for number, link in enumerate(LINKS, start=1):
        parts += [_link(number, link), _joint(number, link)]
    # libfranka looks for a link of exactly this name, and crashes if there is none.
    parts.append(
        '<link name="link8"/><joint name="flange" type="fixed"><parent link="fr3_link7"/>'
        f'<child link="link8"/><origin xyz="0 0 {FLANGE_M}"/></joint></robot>'
    )
    return "".join(parts)


def _link(number: int, link: Link) -> str:
    xx, yy, zz, xy, xz, yz = link.inertia
    return (
        f'<link name="fr3_link{number}"><inertial><origin xyz="{_text(link.centre)}"/>'
        f'<mass value="{link.mass}"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}"'
        f' ixz="{xz}" iyz="{yz}"/></inertial></link>'
    )


def _joint(number: int, link: Link) -> str:
    low, high = link.range_rad
    return (
        f'<joint name="fr3_joint{number}" type="revolute"><parent link="fr3_link{number - 1}"/>'
        f'<child link="fr3_link{number}"/><axis xyz="0 0 1"/>'
        f'<origin xyz="{_text(link_offset(link))}" rpy="{link.alpha} 0 0"/>'
        f'<limit lower="{low}" upper="{high}" velocity="{link.speed_max}"'
        f' effort="{link.torque_max}"/>'
        f'<position_based_velocity_limits kinematic_limit="{link.speed_max}"'
        f' lower_velocity_limit="{-link.speed_max}" upper_velocity_limit="{link.speed_max}"'
        ' velocity_offset="0" deceleration_limit="10"/></joint>'
    )


def _text(values: tuple[float, ...]) -> str:
    return " ".join(repr(value) for value in values)
