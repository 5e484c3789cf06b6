"""Make every asset: textures, then the models that borrow from them, the vehicles, then check."""

import os
import sys

import make_bicycle
import make_blocks
import make_bus
import make_car
import make_motorcycle
import make_person
import make_props
import make_rooms
import make_techniques
import make_textures
import make_town
import make_truck
import make_van

HERE = os.path.dirname(os.path.abspath(__file__))
VEHICLES = {'vehicle_car': make_car, 'vehicle_van': make_van, 'vehicle_truck': make_truck, 'vehicle_bus': make_bus,
            'vehicle_motorcycle': make_motorcycle, 'vehicle_bicycle': make_bicycle, 'person': make_person}

if __name__ == '__main__':
    make_textures.main(os.path.join(HERE, '..', 'textures'))
    make_techniques.main()
    print('techniques')
    make_props.main()
    for name, script in VEHICLES.items():
        script.build(os.path.join(HERE, '..', 'models', name + '.glb'))
        print('model', name)
    make_blocks.main()
    make_rooms.main()
    print('rooms')
    make_town.main()
    print('town')
    sys.exit(os.system('"%s" "%s"' % (sys.executable, os.path.join(HERE, 'check.py'))) != 0)
