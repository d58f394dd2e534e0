//! Members of sets, and the numbers that are kept for them.

use super::*;
use crate::node_files::read_node_file;
use flexbody_base::text::InputFile;

fn own(members: Members) -> Item {
    Item::own(members)
}

fn range(first: i64, last: i64, step: i64) -> Item {
    own(Members::Range { first, last, step })
}

impl NodeSets {
    /// Returns the number of numbers, of words of bits and of parts that are kept.
    fn n_kept(&self) -> usize {
        let of_item = |item: &Item| match &item.members {
            Members::Numbers(numbers) => 1 + numbers.len(),
            Members::Marked(words) => 1 + words.len(),
            Members::Edited(edits) => 1 + edits.len(),
            _ => 1,
        };
        let scopes = self.instances.iter().map(|one| &one.scope).chain([&self.top]);
        let lists = scopes.flat_map(|scope| [&scope.nodes, &scope.elements]);
        lists.flat_map(|list| &list.all).flat_map(|set| &set.items).map(of_item).sum()
    }
}

/// Returns the sets of a file of nodes.
fn sets_of(name: &str, text: impl AsRef<[u8]>) -> NodeSets {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    read_node_file(&InputFile::open(&path).expect("a file"), 3).expect("nodes").sets
}

fn members(sets: &NodeSets, name: &str) -> Vec<i64> {
    sets.find(name).expect("a set").expect("resolved")
}

const NODES: &str = "*NODE\n10,0,0,0\n20,.1,0,0\n30,0,.2,0\n40,0,0,.3\n";

/// Each of 40 levels names the level before it twice: a trillion members, if they were listed.
#[test]
fn sets_of_sets_have_each_member_once() {
    let element = "*ELEMENT, TYPE=C3D4, ELSET=A0\n1, 10,20,30,40\n";
    let levels = |keyword: &str, name: &str| -> String {
        (1..=40)
            .map(|k| format!("*{keyword}, {keyword}={name}{k}\n{name}{}, {name}{}\n", k - 1, k - 1))
            .collect()
    };
    let text = format!("{NODES}*NSET, NSET=B0\n20, 10\n{}", levels("NSET", "B"));
    let sets = sets_of("nodes.inp", text);
    assert_eq!(members(&sets, "B40"), [20, 10], "the order of the file");
    assert!(sets.n_kept() < 200, "{}", sets.n_kept());
    let text = format!("{NODES}{element}{}*NSET, NSET=N, ELSET=A40\n", levels("ELSET", "A"));
    let sets = sets_of("nodes.inp", text);
    assert_eq!(members(&sets, "N"), [10, 20, 30, 40]);
    assert!(sets.n_kept() < 250, "{}", sets.n_kept());
    // A set that names itself is the set as it was above.
    let text =
        format!("{NODES}*NSET, NSET=A\n10, 20\n{}*NSET, NSET=A\n30\n", "*NSET, NSET=A\nA\n".repeat(40));
    assert_eq!(members(&sets_of("nodes.inp", text), "A"), [10, 20, 30]);
}

/// Sets that name an earlier set have its members at that line.
#[test]
fn a_set_has_the_members_that_another_set_had_above() {
    let text =
        format!("{NODES}*NSET, NSET=A\n10\n*NSET, NSET=B\nA\n*NSET, NSET=A\n20\n*NSET, NSET=C\n40, A\n");
    let sets = sets_of("nodes.inp", text);
    assert_eq!(members(&sets, "b"), [10]);
    assert_eq!(members(&sets, "C"), [40, 10, 20]);
    assert_eq!(sets.names().collect::<Vec<_>>(), ["A", "B", "C"]);
}

#[test]
fn ranges_are_the_numbers_that_exist() {
    let lines = "1, 99999999, 1\n1, 200000002, 3\n".repeat(50);
    let text = format!("*NSET, NSET=A, GENERATE\n20, 30, 10\n{lines}{NODES}");
    let sets = sets_of("nodes.inp", text);
    assert_eq!(members(&sets, "A"), [20, 30, 10, 40], "nodes below the set count as well");
    assert!(sets.n_kept() < 150, "{}", sets.n_kept());
    let text = format!(
        "{NODES}*ELEMENT, TYPE=C3D4\n7, 10,20,30,40\n*ELSET, ELSET=E, GENERATE\n{lines}*NSET, NSET=A, ELSET=E\n"
    );
    assert_eq!(members(&sets_of("nodes.inp", text), "A"), [10, 20, 30, 40]);
}

#[test]
fn components_of_ansys_keep_their_ranges() {
    let nodes: String =
        (1..=500).map(|id| format!("{id:9}{:9}{:9}{:21.13E}\n", 0, 0, f64::from(id))).collect();
    let head = "NBLOCK,6,SOLID,500,500\n(3i9,6e21.13e3)\n";
    let components: String =
        (0..500).map(|k| format!("CMBLOCK,C{k},NODE,3\n(8i10)\n{:10}{:10}{:10}\n", 7, 1, -499)).collect();
    let sets = sets_of("nodes.cdb", format!("/PREP7\n{head}{nodes}N,R5.3,LOC,-1,\n{components}"));
    let expected: Vec<i64> = [7, 1].into_iter().chain((2..=499).filter(|id| *id != 7)).collect();
    assert_eq!(members(&sets, "C499"), expected);
    assert!(sets.n_kept() < 500 * 10, "{}", sets.n_kept());
}

/// An entity that belongs to many groups: its nodes are kept once.
#[test]
fn groups_of_gmsh_share_the_nodes_of_their_entities() {
    let groups: String = (1..=300).map(|group| format!(" {group}")).collect();
    let elements: String = (1..=1000).map(|element| format!("{element} 40 20 30 10\n")).collect();
    let text = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"seven\"\n$EndPhysicalNames\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 300{groups} 0\n$EndEntities\n\
        $Nodes\n1 4 10 40\n3 1 0 4\n10\n20\n30\n40\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
        $Elements\n1 1000 1 1000\n3 1 4 1000\n{elements}$EndElements\n"
    );
    let sets = sets_of("mesh.msh", text);
    assert_eq!(members(&sets, "seven"), [10, 20, 30, 40]);
    assert_eq!(members(&sets, "300"), [10, 20, 30, 40]);
    assert!(sets.n_kept() < 500, "{}", sets.n_kept());
}

/// Marks of points take a bit each, and arrays that lie at one place of the file are refused.
#[test]
fn marked_points_of_vtk_take_a_bit() {
    let count = 6400;
    let of = |sets: usize, place: fn(usize) -> usize| {
        let data = [&(24 * count as u32).to_le_bytes()[..], &vec![0; 24 * count]].concat();
        let marks = [&(count as u32).to_le_bytes()[..], &vec![1; count]].concat();
        let array = |k: usize| {
            let offset = data.len() + place(k) * marks.len();
            format!("<DataArray type=\"Int8\" Name=\"s{k}\" format=\"appended\" offset=\"{offset}\"/>")
        };
        let head = format!(
            "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid><Piece NumberOfPoints=\"{count}\"><Points>\
            <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points><PointData>{}</PointData>\
            </Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_",
            (0..sets).map(array).collect::<String>()
        );
        [head.as_bytes(), &data, &marks.repeat(3), b"</AppendedData></VTKFile>"].concat()
    };
    let sets = sets_of("nodes.vtu", of(3, |k| k));
    assert_eq!(members(&sets, "s2").len(), count);
    assert!(sets.n_kept() <= 3 * (1 + count / 64), "{}", sets.n_kept());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("nodes.vtu");
    std::fs::write(&path, of(200, |_| 0)).expect("written");
    let refused = read_node_file(&InputFile::open(&path).expect("a file"), 3).expect_err("refused");
    assert!(refused[0].message().contains("`s3` lies where other arrays lie"), "{}", refused[0].message());
}

/// A chain of sets takes neither a stack nor the square of its length.
#[test]
fn long_chains_of_sets_are_walked_once() {
    let mut list = SetList::default();
    list.add("S0", vec![range(1, 3, 1)]);
    for k in 1..200_000 {
        let before = list.so_far(&format!("S{}", k - 1)).expect("a set");
        list.add(&format!("S{k}"), vec![own(Members::Set(before)), own(Members::Set(before))]);
    }
    let sets = NodeSets::of_nodes(&[1, 2, 3, 4], list);
    assert_eq!(members(&sets, "S199999"), [1, 2, 3]);
}

/// Returns the members of a set as they were listed: all numbers of all parts, then each once.
fn listed(list: &SetList, ids: &[i64], SoFar { set, items }: SoFar) -> Vec<i64> {
    let mut all = Vec::new();
    for item in &list.all[set].items[..items] {
        match &item.members {
            Members::Numbers(numbers) => all.extend(numbers),
            Members::Range { first, last, step } => {
                all.extend((*first..=*last).step_by(*step as usize).filter(|id| ids.contains(id)));
            }
            Members::Set(other) => all.extend(listed(list, ids, *other)),
            other => panic!("{other:?} is not used here"),
        }
    }
    let mut seen = HashSet::new();
    all.retain(|id| seen.insert(*id));
    all
}

proptest::proptest! {
    /// Members are those of the parts, in their order, however parts overlap.
    #[test]
    fn members_are_those_that_would_be_listed(
        ids in proptest::collection::btree_set(-20i64..60, 1..40),
        parts in proptest::collection::vec((0usize..4, -20i64..60, 0i64..40, 1i64..6, 0usize..3), 1..25),
    ) {
        let ids: Vec<i64> = ids.into_iter().collect();
        let mut list = SetList::default();
        for (set, first, length, step, kind) in parts {
            let other = list.so_far(&format!("S{}", length % 4));
            let item = match (kind, other) {
                (0, _) => own(Members::Numbers(vec![first, first + step])),
                (1, Some(other)) => own(Members::Set(other)),
                _ => range(first, first + length, step),
            };
            list.extend(&format!("S{set}"), Ok(vec![item]));
        }
        let expected: Vec<Vec<i64>> =
            (0..list.all.len()).map(|set| listed(&list, &ids, list.all_of(set))).collect();
        let names: Vec<String> = list.names().map(str::to_owned).collect();
        let sets = NodeSets::of_nodes(&ids, list);
        for (name, expected) in names.iter().zip(expected) {
            proptest::prop_assert_eq!(members(&sets, name), expected);
        }
    }
}
