"""Make every asset: textures, then the models that borrow from them, then check."""

import os
import sys

import make_textures
import make_props
import make_town
import make_van

HERE = os.path.dirname(os.path.abspath(__file__))

if __name__ == '__main__':
    make_textures.main(os.path.join(HERE, '..', 'textures'))
    make_props.main()
    make_van.build(os.path.join(HERE, '..', 'models', 'vehicle_van.glb'))
    print('model vehicle_van')
    make_town.main()
    print('town')
    sys.exit(os.system('"%s" "%s"' % (sys.executable, os.path.join(HERE, 'check.py'))) != 0)
