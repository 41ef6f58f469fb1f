"""Reads a URDF with yourdfpy: links, joints, and where the links are for the joint values given."""

import json
import sys


def main() -> None:
    import yourdfpy

    robot = yourdfpy.URDF.load(sys.argv[1])
    robot.update_cfg(json.loads(sys.argv[2]))
    print(
        json.dumps(
            {
                "valid": robot.validate(),
                "meshes": len(robot.scene.geometry),
                "joints": {name: joint.type for name, joint in robot.joint_map.items()},
                "at": {link: robot.get_transform(link)[:3, 3].tolist() for link in robot.link_map},
            }
        )
    )


if __name__ == "__main__":
    main()
