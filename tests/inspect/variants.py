#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Small models of the old form (30000), each with one thing that public files hold, or hold wrong: what is right loads whole and its
moment arms are the slopes of its lengths; what cannot be carried is named with its line; what is wrong is one line and status 2.
    variants.py PATH/mhe-model"""
import json
import os
import subprocess
import sys
import tempfile

CYLINDER = '<radius>0.02</radius><length>0.2</length>'
SPLINE = '<SimmSpline><x>-1 0 1</x><y>0.02 0.03 0.02</y></SimmSpline>'


def coordinate(name, more=''):
    return f'<Coordinate name="{name}"><range>-1.5 1.5</range>{more}</Coordinate>'


def body(name, parent, coordinates, place='0 0 0', wraps='', joint='PinJoint', after='', mass=1):
    return f'''<Body name="{name}"><mass>{mass}</mass><mass_center>0 -0.1 0</mass_center><inertia_xx>0.01</inertia_xx>
<inertia_yy>0.01</inertia_yy><inertia_zz>0.01</inertia_zz><inertia_xy>0</inertia_xy><inertia_xz>0</inertia_xz><inertia_yz>0</inertia_yz>
<Joint><{joint} name="j_{name}"><parent_body>{parent}</parent_body><location_in_parent>{place}</location_in_parent><CoordinateSet><objects>
{coordinates}</objects></CoordinateSet>{after}</{joint}></Joint><WrapObjectSet><objects>{wraps}</objects></WrapObjectSet></Body>
'''


def point(name, of, at, kind='PathPoint', more=''):
    return f'<{kind} name="{name}"><location>{at}</location><body>{of}</body>{more}</{kind}>\n'


def conditional(at, limits='0 1', coordinate='knee', name='b'):
    return point(name, 'up', at, 'ConditionalPathPoint', f'<range>{limits}</range><coordinate>{coordinate}</coordinate>')


def moving(coordinate):
    still = '<Constant><value>-0.1</value></Constant>'
    return point('v', 'up', '0 0 0', 'MovingPathPoint', f'<x_location>{SPLINE}</x_location><y_location>{still}</y_location>'
                 f'<z_location>{still}</z_location><x_coordinate>{coordinate}</x_coordinate><y_coordinate>{coordinate}</y_coordinate>'
                 f'<z_coordinate>{coordinate}</z_coordinate>')


FIRST, LAST = point('a', 'ground', '0.03 0.2 0.01'), point('c', 'low', '0.03 -0.2 0')


def muscle(points=FIRST + LAST, wraps='', kind='Thelen2003Muscle', more=''):
    return f'''<{kind} name="M">{more}<GeometryPath><PathPointSet><objects>
{points}</objects></PathPointSet><PathWrapSet><objects>
{wraps}</objects></PathWrapSet></GeometryPath><max_isometric_force>100</max_isometric_force>
<optimal_fiber_length>0.2</optimal_fiber_length><tendon_slack_length>0.3</tendon_slack_length></{kind}>
'''


def around(name, limits='-1 -1'):
    return f'<PathWrap><wrap_object>{name}</wrap_object><method>hybrid</method><range>{limits}</range></PathWrap>\n'


def obstacle(kind='WrapCylinder', size=CYLINDER, side='all', active='true'):
    return f'<{kind} name="E"><active>{active}</active><xyz_body_rotation>0.1 0 0.2</xyz_body_rotation>' \
        f'<translation>0 0 0</translation><quadrant>{side}</quadrant>{size}</{kind}>'


def coupler(name, of, dependent, function='<LinearFunction><coefficients>0.5 0</coefficients></LinearFunction>', more=''):
    return f'<CoordinateCouplerConstraint name="{name}"><coupled_coordinates_function>{function}</coupled_coordinates_function>' \
        f'<independent_coordinate_names>{of}</independent_coordinate_names><dependent_coordinate_name>{dependent}' \
        f'</dependent_coordinate_name>{more}</CoordinateCouplerConstraint>\n'


def model(forces=None, constraints='', bodies=None, wraps='', hip='', ground=''):
    if bodies is None:
        bodies = body('up', 'ground', coordinate('hip', hip)) + body('low', 'up', coordinate('knee'), '0 -0.3 0', wraps)
    return f'''<OpenSimDocument Version="30000"><Model name="m"><BodySet><objects>
<Body name="ground"><WrapObjectSet><objects>{ground}</objects></WrapObjectSet></Body>
{bodies}</objects></BodySet><ConstraintSet><objects>
{constraints}</objects></ConstraintSet><ForceSet><objects>
{muscle() if forces is None else forces}</objects></ForceSet></Model></OpenSimDocument>
'''


THREE = body('up', 'ground', coordinate('hip')) + body('mid', 'up', coordinate('mid')) + body('low', 'mid', coordinate('knee'), '0 -0.3 0')
SIZES = {'WrapCylinder': CYLINDER, 'WrapSphere': '<radius>0.03</radius>', 'WrapEllipsoid': '<dimensions>0.03 0.02 0.04</dimensions>',
         'WrapTorus': '<inner_radius>0.01</inner_radius><outer_radius>0.05</outer_radius>'}
RIGHT = {f'{kind} {side}': model(muscle(wraps=around('E')), wraps=obstacle(kind, size, side))
         for kind, size in SIZES.items() for side in ('all', '+x', '-X', 'y', 'Unassigned')}
RIGHT.update({
    'chain of couplers': model(None, coupler('c', 'mid', 'knee', '<PolynomialFunction><coefficients>0.1 0.5 0</coefficients></PolynomialFunction>')
                               + coupler('d', 'hip', 'mid', f'<MultiplierFunction><function>{SPLINE}</function><scale>9</scale></MultiplierFunction>'), THREE),
    'coupler, constant': model(None, coupler('c', 'hip', 'knee', '<Constant><value>0.4</value></Constant>')),
    'coupler, broken line': model(None, coupler('c', 'hip', 'knee', '<PiecewiseLinearFunction><x>-1 0 1</x><y>0 0.2 1</y></PiecewiseLinearFunction>')),
    'coupler, GCV spline': model(None, coupler('c', 'hip', 'knee', '<GCVSpline><half_order>3</half_order><x>-1 -0.5 0 0.5 1 1.5</x>'
                                               '<y>0 0.1 0.3 0.4 0.3 0</y></GCVSpline>')),
    'coupler, scaled': model(None, coupler('c', 'hip', 'knee', more='<scale_factor>2</scale_factor>')),
    'coupler that is off': model(None, coupler('c', 'hip', 'knee', more='<isDisabled>true</isDisabled>')),
    'coupled and locked': model(None, coupler('c', 'hip', 'knee'), hip='<locked>true</locked><default_value>0.3</default_value>'),
    'prescribed': model(hip='<prescribed>true</prescribed><prescribed_function><Constant><value>0.2</value></Constant></prescribed_function>'),
    'moving point': model(muscle(FIRST + moving('knee') + LAST)),
    'moving point on a coupled coordinate': model(muscle(FIRST + moving('knee') + LAST), coupler('c', 'hip', 'knee')),
    'conditional point on a coupled one': model(muscle(FIRST + conditional('0.05 -0.15 0') + LAST), coupler('c', 'hip', 'knee')),
    'obstacle of the ground': model(muscle(wraps=around('E')), ground=obstacle()),
    'inactive obstacle': model(muscle(wraps=around('E')), wraps=obstacle(active='false', size='<radius>0</radius>')),
    'obstacle twice, once more between the same points': model(muscle(wraps=around('E') + around('E')), wraps=obstacle()),
    'obstacle twice, between other points': model(muscle(FIRST + point('b', 'low', '-0.03 -0.02 0') + LAST, around('E', '1 2') + around('E', '2 3')),
                                                  wraps=obstacle()),
    'names with colons': model().replace('"up"', '"a::up"').replace('>up<', '>a::up<'),
    'massless body': model(bodies=body('up', 'ground', coordinate('hip'), mass=0) + body('low', 'up', coordinate('knee'), '0 -0.3 0')),
    'joint the other way': model(bodies=body('up', 'ground', coordinate('hip'), after='<reverse>true</reverse>')
                                 + body('low', 'up', coordinate('knee'), '0 -0.3 0')),
    'loop': model(None, '<PointConstraint name="p"><body_1>ground</body_1><body_2>low</body_2><location_body_1>0 -0.5 0</location_body_1>'
                        '<location_body_2>0 -0.2 0</location_body_2></PointConstraint>'),
    'muscle that is off': model(muscle(more='<isDisabled>true</isDisabled>')),
    'Schutte': model(muscle(kind='Schutte1993Muscle_Deprecated')),
    'a force of a simulation': model(muscle() + '<PrescribedForce name="e"/><HuntCrossleyForce name="h"/>'),
    'limit': model(muscle() + '<CoordinateLimitForce name="l"><coordinate>knee</coordinate><upper_stiffness>1</upper_stiffness>'
                              '<upper_limit>60</upper_limit><lower_stiffness>1</lower_stiffness><lower_limit>-10</lower_limit></CoordinateLimitForce>'),
})
NAMED = {
    'function': (model(None, coupler('c', 'hip', 'knee', '<MagicFunction/>')), ': function <MagicFunction> of coupler \'c\''),
    'joint': (model(bodies=body('up', 'ground', coordinate('hip'), joint='MagicJoint') + body('low', 'up', coordinate('knee'))), "MagicJoint 'j_up'"),
    'constraint': (model(None, '<PointOnLineConstraint name="p"/>'), ": PointOnLineConstraint 'p': not enforced"),
    'force': (model(muscle() + '<ClutchedPathSpring name="e"/>'), ": ClutchedPathSpring 'e': its force is missing"),
    'muscle': (model(muscle(kind='MyMuscle')), ": the curves of MyMuscle 'M'"),
}
WRONG = {
    'wrap nobody has': (model(muscle(wraps=around('Eye')), wraps=obstacle()), "muscle 'M' wraps around 'Eye', which no body has"),
    'range of a wrap': (model(muscle(wraps=around('E', '3 7')), wraps=obstacle()), "between its points 3 and 7; it has 2"),
    'moving point': (model(muscle(FIRST + moving('kneee') + LAST)), "unknown coordinate 'kneee' (did you mean 'knee'?)"),
    'two independents': (model(None, coupler('c', 'hip mid', 'knee'), THREE), 'several independent coordinates (hip mid)'),
    'circle': (model(None, coupler('c', 'hip', 'knee') + coupler('d', 'knee', 'hip')), "coupler 'd' closes a circle"),
    'itself': (model(None, coupler('c', 'knee', 'knee')), "coupler 'c' closes a circle"),
    'upside down': (model(muscle(FIRST + conditional('0 0 0', '1 0') + LAST)), 'its range ends (0) before it begins (1)'),
    'conditional': (model(muscle(FIRST + conditional('0 0 0', '0 1', 'nee') + LAST)), "unknown coordinate 'nee'"),
    'all conditional': (model(muscle(conditional('0 0 0') + conditional('0 0 0', name='d'))), "path 'M' (line "),
    'ellipsoid': (model(muscle(wraps=around('E')), wraps=obstacle('WrapEllipsoid', '<dimensions>0.1 0 0.1</dimensions>')), "ellipsoid 'E' needs a size > 0, not 0"),
    'torus': (model(muscle(wraps=around('E')), wraps=obstacle('WrapTorus', '<inner_radius>0.05</inner_radius><outer_radius>0.02</outer_radius>')), "torus 'E'"),
    'side': (model(muscle(wraps=around('E')), wraps=obstacle(side='+q')), "the quadrant of 'E' is '+q'"),
    'NaN in a spline': (model(None, coupler('c', 'hip', 'knee', SPLINE.replace('0.03', 'nan'))), "'nan' is no finite number"),
    'order in a spline': (model(None, coupler('c', 'hip', 'knee', SPLINE.replace('-1 0 1', '-1 1 0'))), 'x does not increase at 0'),
    'NaN in a point': (model(muscle(FIRST.replace('0.2', 'nan') + LAST)), "'nan' is no finite number"),
}
INSIDE = model(muscle(wraps=around('E')), wraps=obstacle('WrapSphere', '<radius>0.3</radius>'))

program, failed = os.path.abspath(sys.argv[1]), []
folder = tempfile.TemporaryDirectory()  # gone at the end
os.chdir(folder.name)
STEP = 1e-5
POSES = [{'q': {'hip': 0.3 + h, 'knee': -0.4 + k}} for h, k in ((0, 0), (STEP, 0), (-STEP, 0), (0, STEP), (0, -STEP))]


def run(*words):
    return subprocess.run([program, *words], capture_output=True, text=True, check=False)


def expect(name, true, what):
    if not true:
        failed.append(name)
        print(f'FAILED {name}: {what}')


def info(text):
    with open('m.osim', 'w', encoding='utf-8') as file:
        file.write(text)
    return run('info', 'm.osim', '--json')


def write_poses(names):
    with open('poses.json', 'w', encoding='utf-8') as file:
        json.dump({'poses': [{'q': {n: v for n, v in pose['q'].items() if n in names}} for pose in POSES]}, file)


for name, text in RIGHT.items():
    said = info(text)
    expect(name, said.returncode == 0, said.stderr)
    if said.returncode == 0:
        answer = json.loads(said.stdout)
        expect(name, not answer['unsupported'], answer['unsupported'])
        free = [c['name'] for c in answer['coordinates']]
        write_poses(free)
        said = run('evaluate', 'm.osim', '--poses', 'poses.json')
        expect(name, said.returncode == 0, said.stderr)
        poses = json.loads(said.stdout)['poses'] if said.returncode == 0 else []
        if poses and 'M' in poses[0]['lines']:
            lines = [pose['lines']['M'] for pose in poses]
            for at, c in ((1, 'hip'), (3, 'knee')):
                if c in free:
                    slope = (lines[at]['length'] - lines[at + 1]['length']) / (2 * STEP)
                    expect(name, abs(slope + lines[0]['moment_arm'].get(c, 0)) < 1e-7, f'{c}: {slope} against {lines[0]["moment_arm"].get(c, 0)}')
for name, (text, part) in NAMED.items():
    said = info(text)
    expect(name, said.returncode == 0 and any(part in line and line.startswith('m.osim:') for line in json.loads(said.stdout)['unsupported']), said)
for name, (text, part) in WRONG.items():
    said = info(text)
    if said.returncode == 0:  # what the file does not say by itself
        write_poses(['hip', 'knee'])
        said = run('evaluate', 'm.osim', '--poses', 'poses.json')
    lines = said.stderr.strip().splitlines()
    expect(name, said.returncode == 2 and len(lines) == 1 and part in lines[0], said)
said = info(model(muscle(wraps=around('E').replace('hybrid', 'fancy')), wraps=obstacle()))
expect('method', said.returncode == 0 and any("M' is 'fancy'" in line for line in json.loads(said.stdout)['warnings']), said)
info(INSIDE)
write_poses(['hip', 'knee'])
said = run('evaluate', 'm.osim', '--poses', 'poses.json')
expect('inside', said.returncode == 0 and "has a point inside 'E'" in said.stderr, said)
print(f'{len(RIGHT)} models load whole, {len(NAMED)} things are named, {len(WRONG)} are refused' if not failed else f'{len(failed)} failed')
os.chdir('/')
sys.exit(bool(failed))
