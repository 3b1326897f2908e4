//! What a URDF draws and no simulation of this kind has, gathered for a few lines of notes: an arm has dozens of joints.

/// Names of what is left out, by what that means.
#[derive(Default)]
pub(super) struct LeftOut {
    /// Joints that could move.
    pub held: Vec<String>,
    /// Links whose collision meshes hit nothing.
    pub hit_nothing: Vec<String>,
    /// Links whose visual meshes are not shown, and whose collision shapes are.
    pub shown_otherwise: Vec<String>,
    /// Links whose visual meshes are not shown, and nothing in their place.
    pub not_shown: Vec<String>,
}

/// Names that a note holds at most.
const MOST_NAMES: usize = 4;

impl LeftOut {
    /// In plain words, one line a kind.
    pub fn notes(&self) -> Vec<String> {
        let kinds = [
            ("joint", &self.held, "no driven wheel's, held fixed at zero"),
            ("link", &self.hit_nothing, "collision meshes are left out, nothing hits there"),
            ("link", &self.shown_otherwise, "visual meshes are left out, recordings show collision shapes instead"),
            ("link", &self.not_shown, "visual meshes are left out, recordings show nothing there"),
        ];
        let said = kinds.iter().filter(|(_, names, _)| !names.is_empty());
        said.map(|(kind, names, what)| format!("{}: {what}", named(kind, names))).collect()
    }
}

/// `link `a``, `links `a` and `b``, `links `a`, `b`, `c`, `d` and 30 more`.
fn named(kind: &str, names: &[String]) -> String {
    let quoted = |names: &[String]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match names {
        [one] => format!("{kind} `{one}`"),
        [start @ .., last] if names.len() <= MOST_NAMES => format!("{kind}s {} and `{last}`", quoted(start)),
        _ => format!("{kind}s {} and {} more", quoted(&names[..MOST_NAMES]), names.len() - MOST_NAMES),
    }
}

#[cfg(test)]
mod tests {
    use super::LeftOut;

    #[test]
    fn a_kind_is_a_line_however_many_there_are() {
        let names = |count: usize| (0..count).map(|it| format!("arm_{it}")).collect::<Vec<_>>();
        let left_out =
            LeftOut { held: names(30), hit_nothing: names(1), shown_otherwise: names(2), ..LeftOut::default() };
        let expected = [
            "joints `arm_0`, `arm_1`, `arm_2`, `arm_3` and 26 more: no driven wheel's, held fixed at zero",
            "link `arm_0`: collision meshes are left out, nothing hits there",
            "links `arm_0` and `arm_1`: visual meshes are left out, recordings show collision shapes instead",
        ];
        assert_eq!(left_out.notes(), expected);
    }
}
